#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "source_tiles.h"

namespace terrane {

/// Heights of one level in one piece, row by row from the north-west, in metres; NaN: none.
struct HeightGrid {
  int64_t cols = 0;
  int64_t rows = 0;
  std::vector<float> heights;

  /// Writes the side * side samples from (x, y) on into `tile`, NaN beyond the grid. Is there any height?
  bool cut(int64_t x, int64_t y, int side, std::span<float> tile) const;
};

/// The finest level's samples, put together from its tiles.
HeightGrid gridOf(const std::vector<SourceTile>& source, const Manifest& manifest);

/// The next coarser level of a pyramid of means: each sample the mean of 2 x 2 finer ones, of those that have
/// a height.
HeightGrid meansOf(const HeightGrid& finer);

}  // namespace terrane
