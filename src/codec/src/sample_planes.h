#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "terrane/tiling/tile_id.h"

/// The four interleaved grids that one level of a tile's lattice consists of, each by itself: corners (known
/// before), quad-centres, edge-centres on horizontal and on vertical edges. Rows of one grid lie side by
/// side, so that what is done for every sample is done for many at once.
namespace terrane {

/// A grid with a rim of two that continues it straight on, so that stencils need no special cases.
class SamplePlane {
 public:
  static constexpr int kRim = 2;
  static constexpr int kStride = 160;  ///< room for 129 samples, the rim, and whole vectors beyond

  SamplePlane() : values_(static_cast<size_t>(kStride) * (kTileCells / 2 + 1 + 2 * kRim)) {}

  void resize(int rows, int cols) {
    rows_ = rows;
    cols_ = cols;
  }
  int rows() const { return rows_; }
  int cols() const { return cols_; }
  int32_t* row(int y) { return values_.data() + (y + kRim) * kStride + 8; }
  const int32_t* row(int y) const { return values_.data() + (y + kRim) * kStride + 8; }

  /// Makes the rim, from complete values. note: wraps around where values are absurd.
  void extend() {
    const auto onward = [](int32_t from, int32_t before) {
      return static_cast<int32_t>(2 * static_cast<uint32_t>(from) - static_cast<uint32_t>(before));
    };
    const int beforeLast = std::max(cols_ - 2, 0);
    for (int y = 0; y < rows_; ++y) {
      int32_t* values = row(y);
      values[-1] = onward(values[0], values[std::min(1, cols_ - 1)]);
      values[-2] = onward(values[-1], values[0]);
      values[cols_] = onward(values[cols_ - 1], values[beforeLast]);
      values[cols_ + 1] = onward(values[cols_], values[cols_ - 1]);
    }
    const auto extendRow = [&](int to, int from, int before) {
      for (int x = -kRim; x < cols_ + kRim; ++x) row(to)[x] = onward(row(from)[x], row(before)[x]);
    };
    extendRow(-1, 0, std::min(1, rows_ - 1));
    extendRow(-2, -1, 0);
    extendRow(rows_, rows_ - 1, std::max(rows_ - 2, 0));
    extendRow(rows_ + 1, rows_, rows_ - 1);
  }
  /// Makes the rim from the nearest values, for sizes of residuals.
  void repeat() {
    for (int y = 0; y < rows_; ++y) {
      int32_t* values = row(y);
      values[-1] = values[-2] = values[0];
      values[cols_] = values[cols_ + 1] = values[cols_ - 1];
    }
    for (int x = -kRim; x < cols_ + kRim; ++x) {
      row(-1)[x] = row(-2)[x] = row(0)[x];
      row(rows_)[x] = row(rows_ + 1)[x] = row(rows_ - 1)[x];
    }
  }

 private:
  int rows_ = 0;
  int cols_ = 0;
  std::vector<int32_t> values_;
};

}  // namespace terrane
