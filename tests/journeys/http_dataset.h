#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "fetching.h"
#include "program.h"
#include "temporary_directory.h"
#include "terrane/dataset/dataset.h"
#include "terrane/stream/open_dataset.h"
#include "terrane/stream/tile_stream.h"

namespace terrane {

/// A dataset with imagery, made by the program, and what must be true wherever it is served.
class HttpDatasetTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory();
    const std::string tif = folder_->file("made.tif"), color = folder_->file("color.tif");
    ASSERT_EQ(Program({"synth", "-o", tif, "--color", color, "--size", "1281", "-q"}).wait(), 0);
    ASSERT_EQ(Program({"build", tif, "--imagery", color, "-o", directory(), "-q"}).wait(), 0);
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::string directory() { return folder_->file("made.terrane"); }
  static std::string bytesOf(const std::string& file) { return readWholeFile(directory() + "/" + file); }

  /// Every way to ask for bytes gives those of the files.
  static void expectFiles(const std::string& url) {
    for (const std::string& form :
         {url, url + "/", url + "/manifest.json", url + "?key=1", url + "/?key=1#top"}) {
      const auto transport = openTransport(form);
      EXPECT_EQ(textOf(fetchOne(*transport, {"manifest.json", 0, 0, false, 0})), bytesOf("manifest.json"))
          << form;
    }
    const auto transport = openTransport(url);
    for (const char* name : {"elevation.pmtiles", "imagery.pmtiles"}) {
      const std::string whole = bytesOf(name);
      for (const uint64_t offset :
           {uint64_t{0}, uint64_t{1}, uint64_t{16384}, whole.size() / 2, whole.size() - 1})
        for (const uint64_t bytes : {uint64_t{1}, uint64_t{127}, uint64_t{16384}, uint64_t{200000}}) {
          const uint64_t most = std::min<uint64_t>(bytes, whole.size() - offset);
          const FetchAnswer answer = fetchOne(*transport, {name, offset, most, false, whole.size()});
          ASSERT_FALSE(answer.failure) << answer.failure->message;
          EXPECT_TRUE(textOf(answer) == whole.substr(offset, most)) << name << " " << offset << " " << most;
        }
      const FetchAnswer other = fetchOne(*transport, {name, 0, 10, false, whole.size() + 1});
      ASSERT_TRUE(other.failure);
      EXPECT_EQ(other.failure->problem, FetchProblem::Fatal);
    }
    EXPECT_EQ(fetchOne(*transport, {"nothing.pmtiles", 0, 10, false, 0}).failure->problem,
              FetchProblem::Missing);
  }

  /// All tiles stream in, in fewer requests than there are tiles; and Dataset reads it like the directory.
  static void expectTiles(const std::string& url) {
    const auto disk = Dataset::open(directory());
    ASSERT_TRUE(disk.ok());
    const auto remote = openDataset(url);
    ASSERT_TRUE(remote.ok()) << remote.error().message;
    const std::vector<TileId> tiles = disk->elevationTiles();
    EXPECT_EQ(remote->elevationTiles(), tiles);
    EXPECT_EQ(*remote->readElevation(tiles), *disk->readElevation(tiles));
    EXPECT_EQ(remote->imageryTiles(0), disk->imageryTiles(0));
    EXPECT_EQ(*remote->readImagery(0, disk->imageryTiles(0)), *disk->readImagery(0, disk->imageryTiles(0)));

    const auto workers = makeThreadWorkers(2);
    TileStream stream(openTransport(url), *workers);
    ASSERT_TRUE(until(stream, [&] { return stream.phase() == StreamPhase::Ready; })) << stream.problem();
    std::vector<StreamWish> wishes;
    for (const TileId id : tiles) wishes.push_back({{TileKey::kElevation, id}, 4.0, 2.0, 1.0, 1000.0, 1.0});
    for (const TileId id : disk->imageryTiles(0)) wishes.push_back({{0, id}, 4.0, 2.0, 1.0, 1000.0, 1.0});
    stream.want(wishes);
    ASSERT_TRUE(until(stream, [&] { return stream.isIdle(); }));
    const StreamStatistics statistics = stream.statistics();
    EXPECT_EQ(statistics.tilesDecoded, wishes.size());
    EXPECT_EQ(statistics.tilesLost + statistics.requestsFailed, 0U);
    // note: how many share one depends on how quickly they are answered: 24 to 68 for 108 tiles were seen.
    EXPECT_LT(statistics.requests, wishes.size() * 3 / 4);
  }

  /// The program draws the same picture from there as from the directory.
  static void expectPicture(const std::string& url) {
    const std::string near = folder_->file("near.png"), far = folder_->file("far.png");
    for (const auto& [from, to] : {std::pair{directory(), near}, std::pair{url, far}}) {
      Program program(
          {"render", from, "-o", to, "--size", "640x360", "--tau", "0.7", "--software", "--overwrite"},
          Program::Hears::Errors);
      const std::string said = program.everything();
      ASSERT_EQ(program.wait(), 0) << said;
    }
    EXPECT_FALSE(readWholeFile(near).empty());
    EXPECT_TRUE(readWholeFile(near) == readWholeFile(far)) << url;
  }

  template <class Condition>
  static bool until(TileStream& stream, const Condition& holds) {
    const auto begun = std::chrono::steady_clock::now();
    for (double now = 0.0; now < 300.0; std::this_thread::yield()) {
      now = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
      stream.poll(now);
      if (holds()) return true;
    }
    return false;
  }

  static inline TemporaryDirectory* folder_ = nullptr;
};

}  // namespace terrane
