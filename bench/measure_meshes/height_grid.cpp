#include "height_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane {

bool HeightGrid::cut(int64_t x, int64_t y, int side, std::span<float> tile) const {
  std::fill(tile.begin(), tile.end(), std::numeric_limits<float>::quiet_NaN());
  const int64_t width = std::min<int64_t>(side, cols - x);
  const int64_t height = std::min<int64_t>(side, rows - y);
  bool any = false;
  for (int64_t row = 0; row < height; ++row) {
    const float* const from = heights.data() + (y + row) * cols + x;
    std::copy(from, from + width, tile.data() + row * side);
    any = any || std::any_of(from, from + width, [](float value) { return !std::isnan(value); });
  }
  return any;
}

HeightGrid gridOf(const std::vector<SourceTile>& source, const Manifest& manifest) {
  HeightGrid grid;
  grid.cols = manifest.extentCols;
  grid.rows = manifest.extentRows;
  grid.heights.assign(static_cast<size_t>(grid.cols * grid.rows), std::numeric_limits<float>::quiet_NaN());
  for (const SourceTile& tile : source) {
    const int64_t left = int64_t{tile.id.col} * kTileCells;
    const int64_t top = int64_t{tile.id.row} * kTileCells;
    const int64_t width = std::min<int64_t>(kTileSamples, grid.cols - left);
    const int64_t height = std::min<int64_t>(kTileSamples, grid.rows - top);
    for (int64_t row = 0; row < height; ++row) {
      const float* const from = tile.heights.data() + row * kTileSamples;
      std::copy(from, from + width, grid.heights.data() + (top + row) * grid.cols + left);
    }
  }
  return grid;
}

HeightGrid meansOf(const HeightGrid& finer) {
  HeightGrid coarser;
  coarser.cols = (finer.cols + 1) / 2;
  coarser.rows = (finer.rows + 1) / 2;
  coarser.heights.reserve(static_cast<size_t>(coarser.cols * coarser.rows));
  for (int64_t y = 0; y < finer.rows; y += 2) {
    for (int64_t x = 0; x < finer.cols; x += 2) {
      float sum = 0.0F;
      int count = 0;
      for (int64_t row = y; row < std::min(y + 2, finer.rows); ++row) {
        for (int64_t col = x; col < std::min(x + 2, finer.cols); ++col) {
          const float height = finer.heights[static_cast<size_t>(row * finer.cols + col)];
          if (std::isnan(height)) continue;
          sum += height;
          ++count;
        }
      }
      coarser.heights.push_back(count == 0 ? std::numeric_limits<float>::quiet_NaN()
                                           : sum / static_cast<float>(count));
    }
  }
  return coarser;
}

}  // namespace terrane
