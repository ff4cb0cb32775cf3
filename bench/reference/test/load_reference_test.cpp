#include "terrane/reference/load_reference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "example_manifest.h"
#include "random_tiles.h"
#include "temporary_directory.h"
#include "terrane/dataset/hash.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {
namespace {

/// A dataset of two levels: of the root's children one is stored, one interpolated, one void, one stored with
/// holes. `tiles` receives what each of them is.
Manifest writeDataset(const TemporaryDirectory& directory, std::map<TileId, Tile>& tiles) {
  Manifest manifest = exampleManifest();
  manifest.imagery.clear();
  manifest.frame.finestLevel = 1;
  manifest.frame.spacingX = 10.0;
  manifest.frame.spacingY = 10.05;
  manifest.extentCols = 450;
  manifest.extentRows = 513;
  manifest.tileCount = 3;

  // The tiles, parents first.
  std::mt19937 random(5);
  Tile root = randomTile(TileId{}, nullptr, manifest.scale, {}, random);
  root.children[0].state = ChildState::Present;
  root.children[1] = {ChildState::Interpolated, 0, 1000, 2000};
  root.children[2] = {};
  root.children[3].state = ChildState::Present;
  tiles.emplace(TileId{}, root);
  tiles.emplace(TileId{1, 0, 0}, randomTile({1, 0, 0}, &root.samples, manifest.scale, {}, random));
  tiles.emplace(TileId{1, 1, 0}, interpolateTile(root, 1));
  tiles.emplace(TileId{1, 1, 1},
                randomTile({1, 1, 1}, &root.samples, manifest.scale, {.voidShare = 0.3}, random));

  std::vector<TileId> stored = {TileId{}, TileId{1, 0, 0}, TileId{1, 1, 1}};
  std::sort(stored.begin(), stored.end(), [](TileId a, TileId b) { return pmtilesId(a) < pmtilesId(b); });
  const std::string archive = directory.file("elevation.pmtiles");
  auto writer = PmtilesWriter::create(archive);
  for (const TileId id : stored) {
    Tile& tile = tiles.at(id);
    if (!id.isRoot()) tile.children.fill({});
    EXPECT_TRUE(writer
                    ->add(id, encodeTile(tile, id.isRoot() ? nullptr : &root.samples,
                                         id.isRoot() ? 0 : id.quadrant(), manifest.scale))
                    .ok());
  }
  EXPECT_TRUE(writer->finish("{}").ok());
  const std::string bytes = readWholeFile(archive);
  manifest.archives = {{"elevation.pmtiles", bytes.size(), sha256(bytes)}};
  writeWholeFile(directory.file("manifest.json"), manifestToJson(manifest));
  return manifest;
}

TEST(LoadReference, HoldsEverySampleOfTheFinestLevel) {
  const TemporaryDirectory directory;
  std::map<TileId, Tile> tiles;
  const Manifest manifest = writeDataset(directory, tiles);
  const auto dataset = Dataset::open(directory.file(""));
  ASSERT_TRUE(dataset.ok()) << dataset.error().message;
  const auto surface = loadReference(*dataset);
  ASSERT_TRUE(surface.ok()) << surface.error().message;

  const ReferenceGrid& grid = surface->grid();
  EXPECT_EQ(grid.cols, manifest.extentCols);
  EXPECT_EQ(grid.rows, manifest.extentRows);
  int64_t ground = 0;
  for (int64_t j = 0; j < grid.rows - 1; ++j) {
    for (int64_t i = 0; i < grid.cols - 1; ++i) {
      const TileId id{1, static_cast<int32_t>(i / kTileCells), static_cast<int32_t>(j / kTileCells)};
      const int x = static_cast<int>(i % kTileCells);
      const int y = static_cast<int>(j % kTileCells);
      const auto tile = tiles.find(id);
      const bool isGround = tile != tiles.end() && tile->second.samples.coverage.covered(x, y);
      ASSERT_EQ(grid.isGround(i, j), isGround) << i << " " << j;
      if (!isGround) continue;
      ++ground;
      ASSERT_EQ(grid.height(i, j), tile->second.samples.heights[static_cast<size_t>(y * kTileSamples + x)])
          << i << " " << j;
    }
  }
  EXPECT_GT(ground, 100000);

  // The way from samples to local metres.
  const glm::dvec2 place = manifest.frame.localFromSample({100.0, 50.0});
  EXPECT_NEAR(*surface->heightAt(place), grid.height(100, 50), 1e-4);
}

TEST(LoadReference, SaysWhatItCannotHold) {
  const TemporaryDirectory directory;
  std::map<TileId, Tile> tiles;
  writeDataset(directory, tiles);
  const auto dataset = Dataset::open(directory.file(""));
  ASSERT_TRUE(dataset.ok());
  const auto surface = loadReference(*dataset, {.memoryBytes = 1000000});
  ASSERT_FALSE(surface.ok());
  EXPECT_NE(surface.error().message.find("450 x 513"), std::string::npos) << surface.error().message;
}

}  // namespace
}  // namespace terrane
