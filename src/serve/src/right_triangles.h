#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace terrane::serve {

/// A mesh over a square of heights.
struct RightTriangles {
  struct Vertex {
    int16_t col = 0;
    int16_t row = 0;
  };
  std::vector<Vertex> vertices;  ///< in the order of their first use
  std::vector<uint32_t>
      indices;  ///< three a triangle, counter-clockwise seen from above with rows going south
};

/// The triangles of longest-edge bisection of `cells` x `cells` cells (a power of two), each square's
/// hypotenuses going as in tiling/lattice.h, that are split as far as heights at hypotenuses' middles, and at
/// those of all triangles within, are off by more than `bound`. Without T-vertices. `heights`: (cells + 1)
/// squared, row by row from the north-west.
RightTriangles rightTriangles(std::span<const float> heights, int cells, double bound);

}  // namespace terrane::serve
