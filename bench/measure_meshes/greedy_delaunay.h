#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane {

/// A triangle's corners as indices of the grid's samples, counter-clockwise with y to the north.
using GreedyTriangle = std::array<uint32_t, 3>;

/// The Delaunay triangulation of some samples of a grid that Garland and Heckbert's greedy insertion gives
/// (1995, "Fast Polygonal Approximation of Terrains and Height Fields"): starting from the grid's corners,
/// the sample that is furthest from the triangles is made a vertex, until none is further than
/// `boundMeters`. `heights`, side * side of them, row by row from the north-west, are all finite. The order
/// of samples equally far off is not said. Cost: some microseconds a vertex.
std::vector<GreedyTriangle> greedyDelaunay(std::span<const float> heights, int side, double boundMeters);

}  // namespace terrane
