#include "height_grid.h"

#include <gtest/gtest.h>

#include <cmath>

namespace terrane {
namespace {

const float kNone = std::nanf("");

TEST(HeightGrid, HoldsWhatItsTilesHold) {
  Manifest manifest;
  manifest.extentCols = 300;
  manifest.extentRows = 270;
  const auto heightAt = [](int x, int y) { return static_cast<float>(x + 1000 * y); };
  std::vector<SourceTile> source;
  for (const int row : {0, 1}) {
    for (const int col : {0, 1}) {
      if (row == 1 && col == 0) continue;
      SourceTile tile;
      tile.id = {1, col, row};
      for (int y = 0; y < kTileSamples; ++y) {
        for (int x = 0; x < kTileSamples; ++x)
          tile.heights.push_back(heightAt(col * kTileCells + x, row * kTileCells + y));
      }
      source.push_back(tile);
    }
  }
  const HeightGrid grid = gridOf(source, manifest);
  ASSERT_EQ(grid.heights.size(), 300U * 270U);
  EXPECT_EQ(grid.heights[269 * 300 + 299], heightAt(299, 269));
  EXPECT_EQ(grid.heights[256 * 300 + 3], heightAt(3, 256));
  EXPECT_TRUE(std::isnan(grid.heights[257 * 300 + 3]));

  std::vector<float> tile(9);
  EXPECT_TRUE(grid.cut(298, 268, 3, tile));
  EXPECT_EQ(tile[4], heightAt(299, 269));
  EXPECT_TRUE(std::isnan(tile[2]) && std::isnan(tile[6]));
  EXPECT_FALSE(grid.cut(10, 260, 3, tile));
}

TEST(HeightGrid, MeansAreOfWhatHasAHeight) {
  const HeightGrid finer = {3, 3, {1.0F, 3.0F, 7.0F, kNone, 8.0F, kNone, kNone, kNone, kNone}};
  const HeightGrid coarser = meansOf(finer);
  EXPECT_EQ(coarser.cols, 2);
  EXPECT_EQ(coarser.rows, 2);
  EXPECT_EQ(coarser.heights[0], 4.0F);
  EXPECT_EQ(coarser.heights[1], 7.0F);
  EXPECT_TRUE(std::isnan(coarser.heights[2]));
  EXPECT_TRUE(std::isnan(coarser.heights[3]));
}

}  // namespace
}  // namespace terrane
