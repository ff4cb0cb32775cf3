#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <thread>

#include "made_dataset.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/dataset.h"
#include "terrane/stream/tile_stream.h"

namespace terrane {
namespace {

/// Real threads and files: the same tiles as decoded straight from the files.
TEST(Threads, ADirectoryStreamsThroughThem) {
  const TemporaryDirectory folder;
  const auto dataset = Dataset::open(madeDataset(folder));
  ASSERT_TRUE(dataset.ok()) << dataset.error().message;
  const auto workers = makeThreadWorkers(2);
  TileStream stream(openTransport(dataset->directory()), *workers);
  const auto until = [&](const auto& isDone) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    double now = 0.0;
    while (!isDone() && std::chrono::steady_clock::now() < deadline) {
      stream.poll(now += 0.001);
      std::this_thread::yield();
    }
    return isDone();
  };
  ASSERT_TRUE(until([&] { return stream.phase() == StreamPhase::Ready; })) << stream.problem();

  std::vector<TileId> ids = dataset->elevationTiles();
  std::sort(ids.begin(), ids.end());
  std::vector<StreamWish> wishes;
  for (const TileId id : ids)
    wishes.push_back(
        {{TileKey::kElevation, id}, 20.0 / (1 + id.level), 10.0 / (1 + id.level), 1.0, 1000.0, 1.0});
  stream.want(wishes);
  ASSERT_TRUE(until([&] { return stream.isIdle(); }));
  std::map<TileId, Tile> truth;
  for (const TileId id : ids) {
    const auto payload = dataset->readElevation(id);
    ASSERT_TRUE(payload.ok());
    auto tile = decodeTile(**payload, id.isRoot() ? nullptr : &truth.at(id.parent()).samples,
                           id.isRoot() ? 0 : id.quadrant(), dataset->manifest().scale);
    ASSERT_TRUE(tile.ok());
    const auto streamed = stream.elevation(id);
    ASSERT_NE(streamed, nullptr) << toString(id);
    EXPECT_EQ(streamed->samples.heights, tile->samples.heights) << toString(id);
    truth.emplace(id, std::move(*tile));
  }
}

}  // namespace
}  // namespace terrane
