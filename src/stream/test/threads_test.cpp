#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <thread>

#include "layered_dataset.h"
#include "made_dataset.h"
#include "terrane/stream/tile_stream.h"

namespace terrane {
namespace {

/// Streams all of a dataset with real threads and files: the same tiles as decoded straight from the files.
void expectToStream(const std::string& directory, const std::map<TileId, Tile>& truth, int layers) {
  const auto workers = makeThreadWorkers(2);
  TileStream stream(openTransport(directory), *workers);
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
  std::vector<StreamWish> wishes;
  for (const auto& [id, tile] : truth)
    wishes.push_back(
        {TileKey::elevation(id, layers - 1), 20.0 / (1 + id.level), 10.0 / (1 + id.level), 1.0, 1000.0, 1.0});
  stream.want(wishes);
  ASSERT_TRUE(until([&] { return stream.isIdle(); }));
  for (const auto& [id, tile] : truth) {
    const auto streamed = stream.elevation(id);
    ASSERT_NE(streamed, nullptr) << toString(id);
    EXPECT_EQ(streamed->samples.layerCount, layers);
    EXPECT_EQ(streamed->samples.heights, tile.samples.heights) << toString(id);
  }
}

TEST(Threads, ADirectoryStreamsThroughThem) {
  const TemporaryDirectory folder;
  const auto dataset = Dataset::open(madeDataset(folder));
  ASSERT_TRUE(dataset.ok()) << dataset.error().message;
  std::map<TileId, Tile> truth = decodedTiles(*dataset);
  expectToStream(dataset->directory(), truth, 1);

  constexpr int kLayers = 4;
  const std::string layered = folder.file("layered.terrane");
  putIntoLayers(truth, dataset->manifest().frame.finestLevel, kLayers);
  ASSERT_TRUE(writeLayeredDataset(*dataset, truth, kLayers, layered).ok());
  expectToStream(layered, truth, kLayers);
}

}  // namespace
}  // namespace terrane
