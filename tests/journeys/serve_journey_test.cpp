#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "http_client.h"
#include "program.h"
#include "terrane/dataset/dataset.h"
#include "terrane/dataset/pmtiles.h"

/// The program itself: `terrane serve`, asked over the line, stopped, killed and started again.
namespace terrane {
namespace {

namespace fs = std::filesystem;
using serve::ClientAnswer;
using serve::HttpClient;

class ServeJourney : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new fs::path(fs::temp_directory_path() / ("terrane_serve_" + std::to_string(getpid())));
    fs::create_directories(*folder_);
    const std::string tif = (*folder_ / "made.tif").string(), color = (*folder_ / "color.tif").string();
    ASSERT_EQ(Program({"synth", "-o", tif, "--color", color, "--size", "2049", "-q"}).wait(), 0);
    ASSERT_EQ(Program({"build", tif, "--imagery", color, "-o", dataset(), "-q"}).wait(), 0);
  }
  static void TearDownTestSuite() {
    fs::remove_all(*folder_);
    delete folder_;
  }
  static std::string dataset() { return (*folder_ / "made.terrane").string(); }
  static nlohmann::json listed(int port) {
    HttpClient client(port);
    const auto answer = client.get("/datasets.json");
    return answer ? nlohmann::json::parse(answer->body, nullptr, false)["datasets"][0] : nlohmann::json();
  }
  static fs::path* folder_;
};
fs::path* ServeJourney::folder_ = nullptr;

TEST_F(ServeJourney, AnArchiveReadByRangesIsTheFile) {
  Program program({"serve", dataset(), "--port", "0", "-q"});
  const int port = portOf(program.firstLine());
  ASSERT_GT(port, 0);
  const std::string base = listed(port)["immutable"];
  HttpClient client(port);
  for (const std::string& name : {std::string("elevation.pmtiles"), std::string("imagery.pmtiles")}) {
    const std::string whole = readWholeFile(dataset() + "/" + name);
    std::string read;
    std::mt19937 random(2);
    while (read.size() < whole.size()) {
      const size_t end = std::min(whole.size(), read.size() + 1 + random() % 200000) - 1;
      const auto answer = client.get(
          base + name, "Range: bytes=" + std::to_string(read.size()) + "-" + std::to_string(end) + "\r\n");
      ASSERT_TRUE(answer);
      ASSERT_EQ(answer->status, 206);
      read += answer->body;
    }
    EXPECT_TRUE(read == whole) << name;
    // What was fetched opens as an archive.
    const std::string copy = (*folder_ / "copy.pmtiles").string();
    std::ofstream(copy, std::ios::binary) << read;
    const auto reader = PmtilesReader::open(copy);
    ASSERT_TRUE(reader.ok()) << reader.error().message;
    for (const TileId id : reader->tiles()) {
      const auto stored = reader->read(id);
      const auto tile =
          client.get(base + (name == "elevation.pmtiles" ? "elevation/" : "imagery/imagery/") + toString(id));
      ASSERT_TRUE(tile);
      ASSERT_EQ(tile->body, std::string((*stored)->begin(), (*stored)->end()));
    }
  }
}

TEST_F(ServeJourney, NothingOfTheGpuIsLoaded) {
  Program program({"serve", dataset(), "--port", "0", "-q"});
  const int port = portOf(program.firstLine());
  HttpClient client(port);
  ASSERT_EQ(client.get("/d/made/elevation?points=500000,6700000")->status, 200);
  const std::string maps = program.procFile("maps");
  EXPECT_NE(maps.find("libc.so"), std::string::npos);
  for (const char* library : {"libGL", "libEGL", "libOpenGL", "swrast", "libgallium", "libX11", "libwayland"})
    EXPECT_EQ(maps.find(library), std::string::npos) << library;
}

TEST_F(ServeJourney, MemoryStaysFlat) {
  Program program({"serve", dataset(), "--port", "0", "-q", "--cache", "8M", "--threads", "2"});
  const int port = portOf(program.firstLine());
  const std::string base = listed(port)["immutable"];
  const uint64_t bytes = listed(port)["files"][0]["bytes"];
  std::mt19937 random(3);
  const auto load = [&](int rounds) {
    for (int round = 0; round < rounds; ++round) {
      std::vector<std::unique_ptr<HttpClient>> clients;
      for (int i = 0; i < 50; ++i) {
        clients.push_back(std::make_unique<HttpClient>(port));
        const uint64_t begin = random() % bytes;
        clients.back()->sendGet(base + "elevation.pmtiles", "Range: bytes=" + std::to_string(begin) + "-" +
                                                                std::to_string(begin + 100000) + "\r\n");
      }
      // Some leave before they are answered.
      for (size_t i = 0; i < clients.size(); ++i) {
        if (i % 5 != 0) {
          ASSERT_TRUE(clients[i]->receive());
        }
      }
      HttpClient asking(port);
      std::uniform_real_distribution<double> place(-10000.0, 10000.0);
      for (int i = 0; i < 10; ++i) {
        const std::string point =
            std::to_string(500000.0 + place(random)) + "," + std::to_string(6700000.0 + place(random));
        ASSERT_EQ(asking.get("/d/made/elevation?points=" + point)->status, 200);
      }
    }
  };
  load(20);
  const int64_t warm = program.residentKilobytes();
  load(60);
  EXPECT_LT(program.residentKilobytes(), warm + 8000) << "kilobytes, from " << warm;
}

TEST_F(ServeJourney, TerminationLetsADownloadFinish) {
  for (const int number : {SIGTERM, SIGINT}) {
    Program program({"serve", dataset(), "--port", "0", "-q", "--grace", "60"});
    const int port = portOf(program.firstLine());
    // An archive is larger than what the system holds for a reader this narrow.
    HttpClient slow(port, 4096);
    ASSERT_TRUE(slow.sendGet("/d/made/elevation.pmtiles"));
    ASSERT_TRUE(slow.more(HttpClient::endOf(20.0)));
    program.signal(number);
    const auto answer = slow.receive(false, 60.0);
    ASSERT_TRUE(answer);
    EXPECT_TRUE(answer->body == readWholeFile(dataset() + "/elevation.pmtiles"));
    EXPECT_TRUE(slow.closes());
    EXPECT_EQ(program.wait(), 0);
    EXPECT_FALSE(HttpClient(port).connected());
  }
}

TEST_F(ServeJourney, KilledAndStartedAgainAtTheSamePortItServesTheSame) {
  int port = 0;
  std::string etag;
  for (int round = 0; round < 3; ++round) {
    Program program({"serve", dataset(), "--port", std::to_string(port), "-q"});
    const int given = portOf(program.firstLine());
    ASSERT_GT(given, 0) << "round " << round;
    if (port != 0) {
      ASSERT_EQ(given, port);
    }
    port = given;
    HttpClient client(port), unread(port, 4096);
    const auto answer = client.get("/d/made/elevation.pmtiles", "Range: bytes=0-126\r\n");
    ASSERT_TRUE(answer);
    if (!etag.empty()) {
      EXPECT_EQ(answer->fields.at("ETag"), etag);
    }
    etag = answer->fields.at("ETag");
    // A download is under way when it is killed: the reader sees the end, not bytes that are wrong.
    ASSERT_TRUE(unread.sendGet("/d/made/imagery.pmtiles"));
    ASSERT_TRUE(unread.more(HttpClient::endOf(20.0)));
    program.signal(SIGKILL);
    EXPECT_EQ(program.wait(), -1);
    EXPECT_TRUE(client.closes());
  }
}

TEST_F(ServeJourney, AccessesAreLoggedALineEach) {
  const fs::path log = *folder_ / "access.log";
  Program program({"serve", dataset(), "--port", "0", "-q", "--access-log", log.string()});
  HttpClient client(portOf(program.firstLine()));
  ASSERT_TRUE(client.get("/healthz"));
  ASSERT_TRUE(client.get("/d/none/manifest.json"));
  ASSERT_TRUE(client.get("/d/made/%22%0a"));
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), 0);
  const std::string text = readWholeFile(log);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3);
  EXPECT_NE(text.find("127.0.0.1 - - ["), std::string::npos);
  EXPECT_NE(text.find("\"GET /healthz HTTP/1.1\" 200 3 "), std::string::npos);
  EXPECT_NE(text.find("\"GET /d/none/manifest.json HTTP/1.1\" 404 "), std::string::npos);
}

}  // namespace
}  // namespace terrane
