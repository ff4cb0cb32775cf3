#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "terrane/base/result.h"

namespace terrane {

/// The height of a cell's surface at (a, b) in [0, 1]^2 from its north-west corner. `corners`: north-west,
/// north-east, south-west, south-east. `even`: whether i + j is even for the cell's north-west sample, which
/// decides the diagonal.
double heightInCell(bool even, const std::array<double, 4>& corners, double a, double b);

/// A grid of samples, row by row from the north-west; sample (i, j) stands at local
/// (i * spacingX, -j * spacingY).
struct ReferenceGrid {
  int64_t cols = 0;  ///< samples, at least 2
  int64_t rows = 0;
  double spacingX = 1.0;  ///< metres
  double spacingY = 1.0;
  std::vector<float> heights;  ///< cols * rows, metres, finite
  std::vector<uint8_t>
      groundCells;  ///< (cols - 1) * (rows - 1) bits, least significant first: cell is ground

  int64_t cellIndex(int64_t i, int64_t j) const { return j * (cols - 1) + i; }
  bool isGround(int64_t i, int64_t j) const {
    const int64_t cell = cellIndex(i, j);
    return (groundCells[static_cast<size_t>(cell >> 3)] >> (cell & 7) & 1) != 0;
  }
  void setGround(int64_t i, int64_t j) {
    const int64_t cell = cellIndex(i, j);
    groundCells[static_cast<size_t>(cell >> 3)] |= static_cast<uint8_t>(1U << (cell & 7));
  }
  float height(int64_t i, int64_t j) const { return heights[static_cast<size_t>(j * cols + i)]; }
};

/// The full-resolution surface of a dataset, to measure pictures against: each ground cell of the finest grid
/// as two triangles, parted by the diagonal between its two corners with i + j even. Double precision, all in
/// memory (5 bytes a sample), no code in common with the level of detail. Const calls may come from any
/// thread. Local metres throughout.
class ReferenceSurface {
 public:
  /// Takes the grid over and makes the bounds that rays descend through.
  explicit ReferenceSurface(ReferenceGrid grid);

  struct Hit {
    double distance = 0.0;  ///< in lengths of the ray's direction
    glm::dvec3 point{0.0};
    bool fromAbove = true;  ///< false: the ray came from under the surface
  };
  /// The first triangle that a ray meets at a distance of 0 or more, edges included (by a billionth of a
  /// cell more, so that no ray slips between two triangles). Triangles that the ray runs along are not met.
  std::optional<Hit> cast(glm::dvec3 origin, glm::dvec3 direction) const;

  /// The surface's height at a place; nothing where there is no ground.
  std::optional<double> heightAt(glm::dvec2 place) const;

  /// Is there ground everywhere in a box of local places? Cost: a look at each cell.
  bool isAllGround(glm::dvec2 low, glm::dvec2 high) const;

  /// Would the ray meet *any* continuous surface over the ground, as long as its heights lie between the
  /// lowest and the highest of this one? It would if it comes from above the highest, and stays over ground
  /// until it is below the lowest. Ground counts where all ground is ground within `marginCells` too, rounded
  /// up to a block of that size.
  class Cover {
   public:
    Cover(const ReferenceSurface& surface, int64_t marginCells);
    bool mustHit(glm::dvec3 origin, glm::dvec3 direction) const;

   private:
    const ReferenceSurface& surface_;
    int64_t blockCells_;
    int64_t cols_;
    int64_t rows_;
    std::vector<uint8_t> full_;
  };

  const ReferenceGrid& grid() const { return grid_; }
  /// Over the ground's corners; 0 where there is no ground.
  double minHeight() const { return hasGround() ? levels_.back().blocks[0].low : 0.0; }
  double maxHeight() const { return hasGround() ? levels_.back().blocks[0].high : 0.0; }
  bool hasGround() const { return levels_.back().blocks[0].low <= levels_.back().blocks[0].high; }

 private:
  /// Bounds of the heights in a square block of cells; low > high where none is ground.
  struct Block {
    float low = 1.0F;
    float high = 0.0F;
  };
  struct Level {
    int64_t cols = 0;
    int64_t rows = 0;
    int64_t cells = 0;  ///< along a block's side
    std::vector<Block> blocks;
  };
  /// A ray in sample coordinates: x in columns, y in rows, z in metres.
  struct Ray {
    glm::dvec3 origin;
    glm::dvec3 direction;
    glm::dvec3 inverse;
  };
  Ray toSamples(glm::dvec3 origin, glm::dvec3 direction) const;
  Block boundsOfCells(int64_t i, int64_t j, int64_t cells) const;
  void castBlock(size_t level, int64_t col, int64_t row, const Ray& ray, std::optional<Hit>& best) const;
  void castCell(int64_t i, int64_t j, const Ray& ray, std::optional<Hit>& best) const;
  std::array<double, 4> corners(int64_t i, int64_t j) const;

  ReferenceGrid grid_;
  std::vector<Level> levels_;  ///< finest blocks first, the last is one block
};

}  // namespace terrane
