#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "terrane/codec/patch_mesh.h"

/// Between which heights the meshes of a level lie, whatever their morph: what they surely hide behind them,
/// and what surely does not stand out above others.
namespace terrane {

/// A patch's triangle in its tile's cells. Since its sides run along the axes or the diagonals, it is what
/// lies between bounds of x, y, x - y and x + y.
struct PatchOutline {
  int left = 0, right = 0, top = 0, bottom = 0;
  int leastDifference = 0, mostDifference = 0, leastSum = 0, mostSum = 0;

  explicit PatchOutline(const PatchCorners& of) {
    const auto &p = of.ends[0], &q = of.ends[1], &r = of.apex;
    const auto [x0, x1] = std::minmax({p[0], q[0], r[0]});
    const auto [y0, y1] = std::minmax({p[1], q[1], r[1]});
    const auto [d0, d1] = std::minmax({p[0] - p[1], q[0] - q[1], r[0] - r[1]});
    const auto [s0, s1] = std::minmax({p[0] + p[1], q[0] + q[1], r[0] + r[1]});
    left = x0, right = x1, top = y0, bottom = y1;
    leastDifference = d0, mostDifference = d1, leastSum = s0, mostSum = s1;
  }
  /// From where to where it reaches on a row that it meets, or a column.
  std::array<int, 2> onRow(int y) const {
    return {std::max({left, y + leastDifference, leastSum - y}),
            std::min({right, y + mostDifference, mostSum - y})};
  }
  std::array<int, 2> onColumn(int x) const {
    return {std::max({top, x - mostDifference, leastSum - x}),
            std::min({bottom, x - leastDifference, mostSum - x})};
  }
  /// The same for all of the rows from one to the next, `step` below.
  std::array<int, 2> inRows(int y, int step) const {
    const auto a = onRow(y), b = onRow(y + step);
    return {std::min(a[0], b[0]), std::max(a[1], b[1])};
  }
};

/// Each patch is cut into squares of `step` cells, and the triangles that are left of them at its sides. Of a
/// patch there are the highest height in each square, row by row, and the lowest on each square's side that
/// lies in the patch: those on rows, line by line, and those on columns, line by line. Codes of 8 bits
/// between the patch's lowest and highest.
struct MeshRelief {
  struct Range {
    float lowMeters = 0.0F;
    float unitMeters = 0.0F;
    float height(uint8_t code) const { return lowMeters + static_cast<float>(code) * unitMeters; }
  };
  int step = 0;
  std::vector<Range> ranges;   ///< of each patch
  std::vector<uint8_t> codes;  ///< reliefCounts() of each patch

  size_t sizeBytes() const { return ranges.size() * sizeof(Range) + codes.size(); }
};

/// A quarter of a patch's height, at least a cell.
int reliefStep(int level);

/// How many codes a patch has.
struct ReliefCounts {
  int squares = 0;
  int onRows = 0;
  int onColumns = 0;
  int all() const { return squares + onRows + onColumns; }
};
ReliefCounts reliefCounts(int level, const PatchOutline& outline);

}  // namespace terrane
