#include "paper_form.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace terrane {
namespace {

HeightGrid wavyGrid(int64_t cols, int64_t rows) {
  HeightGrid grid;
  grid.cols = cols;
  grid.rows = rows;
  for (int64_t y = 0; y < rows; ++y) {
    for (int64_t x = 0; x < cols; ++x) {
      const double height =
          400.0 * std::sin(static_cast<double>(x) / 9.0) * std::cos(static_cast<double>(y) / 7.0);
      grid.heights.push_back(static_cast<float>(height));
    }
  }
  return grid;
}

TEST(PaperForm, HasTheLevelsTilesAndBoundsOfThePaper) {
  constexpr double kSpacing = 30.0;
  const auto form = encodePaperForm(wavyGrid(600, 520), kSpacing, 4);
  ASSERT_TRUE(form.ok()) << form.error().message;
  const std::vector<double> spacings = {0.25, 0.5, 1.0, 2.0};
  const std::vector<int64_t> tiles = {5 * 5, 3 * 3, 2 * 2, 1};
  ASSERT_EQ(form->levels.size(), spacings.size());
  for (size_t i = 0; i < spacings.size(); ++i) {
    EXPECT_EQ(form->levels[i].spacings, spacings[i]);
    EXPECT_EQ(form->levels[i].tiles, tiles[i]);
  }
  for (size_t i = 1; i < spacings.size(); ++i) EXPECT_LT(form->levels[i].bits, form->levels[i - 1].bits);

  ASSERT_EQ(form->finest.size(), 25U);
  uint64_t bits = 0;
  for (const StripMesh& mesh : form->finest) {
    EXPECT_EQ(mesh.side, 129);
    EXPECT_LE(mesh.stepMeters, 2.0 * 0.25 * 0.25 * kSpacing * (1.0 + 1e-9));
    bits += mesh.bitCount();
  }
  EXPECT_EQ(form->levels[0].bits, bits);
  EXPECT_TRUE(measurePaperDecoding(form->finest).ok());
}

TEST(PaperForm, LeavesOutTilesWithoutAHeight) {
  HeightGrid grid = wavyGrid(520, 100);
  for (int64_t y = 0; y < grid.rows; ++y) {
    for (int64_t x = 0; x <= 300; ++x)
      grid.heights[static_cast<size_t>(y * grid.cols + x)] = std::numeric_limits<float>::quiet_NaN();
  }
  const auto form = encodePaperForm(grid, 30.0, 2);
  ASSERT_TRUE(form.ok()) << form.error().message;
  EXPECT_EQ(form->levels[0].tiles, 2);
  EXPECT_EQ(form->levels[1].tiles, 2);
  EXPECT_EQ(form->levels[2].tiles, 1);
}

}  // namespace
}  // namespace terrane
