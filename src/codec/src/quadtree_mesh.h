#pragma once

#include <cstdint>
#include <vector>

#include "strip_heights.h"

/// Which triangles of a square are split: a restricted quadtree mesh (longest-edge bisection) that starts
/// from four right triangles about the middle.
///
/// A split is known by the sample on which it happens, the midpoint of the hypotenuse, which two triangles
/// share (one at the border). With s the lowest bit set in x or y, a midpoint (x, y) is
///  - a quad-centre if both have it: the middle of a square of side 2s, split along a diagonal;
///  - an edge-centre else: the middle of an edge of such a square, split across it.
/// The right angles of the triangles about it are midpoints themselves, those of the splits that made the
/// triangles: it can be split when they are.
namespace terrane {

/// One byte a sample, row by row: 1 where a hypotenuse is split. The smallest mesh without T-vertices such
/// that no known sample is further than the bound from the triangle it lies on (its corners being the
/// quantised heights).
std::vector<uint8_t> splitsWithin(const StripHeights& heights, int side, double boundMeters);

}  // namespace terrane
