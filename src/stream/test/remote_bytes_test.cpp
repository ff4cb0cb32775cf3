#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <mutex>
#include <random>
#include <set>

#include "layered_dataset.h"
#include "made_dataset.h"
#include "scripted_server.h"
#include "terrane/stream/open_dataset.h"

/// Reading over a line by those who can wait.
namespace terrane {
namespace {

using Request = ScriptedServer::Request;

class RemoteBytesTest : public ::testing::Test {
 protected:
  RemoteBytesTest() {
    std::mt19937 random(1);
    for (const auto& [name, bytes] : {std::pair{"a.pmtiles", 900000}, std::pair{"b.pmtiles", 50000}})
      for (int i = 0; i < bytes; ++i) files_[name] += static_cast<char>(random());
  }
  std::string nameOf(const Request& request) const {
    return request.target.substr(request.target.rfind('/') + 1);
  }
  ScriptedServer::Reply serve(const Request& request) const {
    const auto file = files_.find(nameOf(request));
    return file == files_.end() ? ScriptedServer::reply(404, "", "")
                                : ScriptedServer::honest(request, file->second);
  }
  std::unique_ptr<ByteSource> open(const ScriptedServer& server, RemoteOptions options = {}) const {
    auto source = openRemoteBytes(openTransport(server.url()), options);
    for (const auto& [name, bytes] : files_) EXPECT_TRUE(source->open(name, bytes.size()).ok());
    return source;
  }
  std::vector<FileRange> someRanges(std::mt19937& random, size_t count, uint64_t mostBytes) const {
    std::vector<FileRange> out;
    for (size_t i = 0; i < count; ++i) {
      const auto& [name, bytes] = *std::next(files_.begin(), random() % 2);
      const uint64_t offset = random() % bytes.size();
      out.push_back({name, offset, std::min<uint64_t>(1 + random() % mostBytes, bytes.size() - offset)});
    }
    return out;
  }
  void expectTrue(const ByteSource& source, const std::vector<FileRange>& ranges) const {
    const auto read = source.read(ranges);
    ASSERT_TRUE(read.ok()) << read.error().message;
    ASSERT_EQ(read->size(), ranges.size());
    for (size_t i = 0; i < ranges.size(); ++i)
      EXPECT_TRUE(std::string((*read)[i].begin(), (*read)[i].end()) ==
                  files_.at(ranges[i].file).substr(ranges[i].offset, ranges[i].bytes))
          << ranges[i].file << " " << ranges[i].offset;
  }

  std::map<std::string, std::string> files_;
};

TEST_F(RemoteBytesTest, RangesInAnyOrderAreTheirBytesAndNeighboursShareRequests) {
  ScriptedServer server([this](const Request& request) { return serve(request); });
  uint64_t received = 0;
  RemoteOptions options;
  options.received = [&](uint64_t bytes) { received += bytes; };
  const auto source = open(server, options);
  std::mt19937 random(2);
  for (int turn = 0; turn < 20; ++turn) expectTrue(*source, someRanges(random, 60, 20000));
  expectTrue(*source, {});
  EXPECT_GT(received, 900000U);

  const size_t before = server.requests().size();
  std::vector<FileRange> neighbours;
  for (uint64_t i = 0; i < 64; ++i) neighbours.push_back({"a.pmtiles", (i * 37 % 64) * 8000, 7000});
  expectTrue(*source, neighbours);
  EXPECT_LE(server.requests().size() - before, 3U);

  const auto whole = source->readWhole("b.pmtiles");
  ASSERT_TRUE(whole.ok());
  EXPECT_TRUE(*whole == files_["b.pmtiles"]);
}

TEST_F(RemoteBytesTest, WhatFailsOnceIsAskedForAgain) {
  std::mutex mutex;
  std::set<std::string> asked;
  int turn = 0;
  ScriptedServer server([&](const Request& request) {
    const std::lock_guard lock(mutex);
    ScriptedServer::Reply reply = serve(request);
    if (!asked.insert(request.field("range")).second) return reply;
    switch (turn++ % 4) {
      case 0:
        return ScriptedServer::reply(503, "", "");
      case 1:
        reply.bytes.resize(reply.bytes.size() - 1);
        reply.closes = true;
        return reply;
      case 2:
        reply.bytes.clear();
        reply.resets = true;
        return reply;
      default:
        return reply;
    }
  });
  const auto source = open(server);
  std::mt19937 random(3);
  expectTrue(*source, someRanges(random, 12, 2000));
  EXPECT_GT(turn, 4);
}

TEST_F(RemoteBytesTest, AServerThatComesBackIsWaitedForAndOneThatStaysAwayIsNot) {
  auto server = std::make_unique<ScriptedServer>([this](const Request& request) { return serve(request); });
  const int port = server->port();
  std::atomic<int> troubles{0};
  RemoteOptions options;
  options.patienceSeconds = 60.0;
  // It comes back when its being away has been noticed.
  options.trouble = [&](const std::string& problem) {
    EXPECT_NE(problem.find("asking again"), std::string::npos);
    ++troubles;
    server =
        std::make_unique<ScriptedServer>([this](const Request& request) { return serve(request); }, port);
  };
  const auto source = open(*server, options);
  std::mt19937 random(4);
  expectTrue(*source, someRanges(random, 5, 100));
  server.reset();
  expectTrue(*source, someRanges(random, 5, 100));
  EXPECT_EQ(troubles, 1);

  options = {};
  options.patienceSeconds = options.openingSeconds = 0.3;
  for (const bool wasThere : {true, false}) {
    const auto hasty = open(*server, options);
    if (wasThere) expectTrue(*hasty, someRanges(random, 5, 100));
    auto gone = std::move(server);
    gone.reset();
    const auto read = hasty->read(std::vector<FileRange>{{"a.pmtiles", 5, 100000}, {"b.pmtiles", 7, 20000}});
    ASSERT_FALSE(read.ok());
    EXPECT_NE(read.error().message.find("nobody has answered"), std::string::npos) << read.error().message;
    EXPECT_NE(read.error().message.find("120 kB of the 120 kB"), std::string::npos) << read.error().message;
    server =
        std::make_unique<ScriptedServer>([this](const Request& request) { return serve(request); }, port);
  }
}

TEST_F(RemoteBytesTest, WhatCannotBeHadIsSaidAtOnce) {
  ScriptedServer server([this](const Request& request) { return serve(request); });
  const auto source = openRemoteBytes(openTransport(server.url()));
  const auto nothing = source->readWhole("manifest.json");
  ASSERT_FALSE(nothing.ok());
  EXPECT_NE(nothing.error().message.find("/made/manifest.json: the server answers 404; is this"),
            std::string::npos)
      << nothing.error().message;
  ASSERT_TRUE(source->open("a.pmtiles", files_["a.pmtiles"].size() + 1).ok());
  const auto other = source->read(std::vector<FileRange>{{"a.pmtiles", 0, 10}});
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message.find("another build"), std::string::npos) << other.error().message;
  // A range that comes damaged each time is not asked for for ever.
  server.setScript([this](const Request& request) {
    ScriptedServer::Reply reply = serve(request);
    reply.bytes.resize(reply.bytes.size() - 1);
    reply.closes = true;
    return reply;
  });
  const size_t before = server.requests().size();
  EXPECT_FALSE(open(server)->read(std::vector<FileRange>{{"a.pmtiles", 0, 1000}}).ok());
  EXPECT_EQ(server.requests().size() - before, 4U);
  EXPECT_FALSE(openDataset(server.url()).ok());
}

TEST_F(RemoteBytesTest, ADatasetIsReadInAllItsLayersOfSignificance) {
  const TemporaryDirectory folder;
  const auto plain = Dataset::open(madeDataset(folder));
  ASSERT_TRUE(plain.ok()) << plain.error().message;
  std::map<TileId, Tile> tiles = decodedTiles(*plain);
  constexpr int kLayers = 3;
  putIntoLayers(tiles, plain->manifest().frame.finestLevel, kLayers);
  const std::string layered = folder.file("layered.terrane");
  ASSERT_TRUE(writeLayeredDataset(*plain, tiles, kLayers, layered).ok());

  ScriptedServer server([&](const Request& request) {
    return ScriptedServer::honest(request, readWholeFile(layered + "/" + nameOf(request)));
  });
  const auto dataset = openDataset(server.url());
  ASSERT_TRUE(dataset.ok()) << dataset.error().message;
  EXPECT_EQ(dataset->manifest().scale.layerCount, kLayers);
  for (const auto& [id, tile] : tiles) {
    const auto payloads = dataset->readAllLayers(id);
    ASSERT_TRUE(payloads.ok() && payloads->has_value()) << toString(id);
    const auto read = decodeAllLayers(**payloads, id.isRoot() ? nullptr : &tiles.at(id.parent()).samples,
                                      id.isRoot() ? 0 : id.quadrant(), dataset->manifest().scale);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->samples.heights, tile.samples.heights) << toString(id);
  }
}

}  // namespace
}  // namespace terrane
