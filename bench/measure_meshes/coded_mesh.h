#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "terrane/codec/tile.h"

namespace terrane {

/// A triangle's corners as indices of a tile's samples, counter-clockwise seen from above.
using CodedTriangle = std::array<uint32_t, 3>;

/// The adaptive mesh that a tile's bytes hold: the leaves of longest-edge bisection (tiling/lattice.h) inside
/// the tile, where a diamond is split if its sample is Coded or an ancestor, in the tile, of one that is.
/// Between corners it equals the samples that the tile decodes to, Interpolated and Void ones being means of
/// hypotenuse's ends; so its error is theirs. It covers the tile once and has no T-vertices.
///
/// Triangles with a Void corner are left out. In tiles of the finest level no ground lies on them, since no
/// sample with a height depends on one without.
class CodedMesh {
 public:
  CodedMesh() : triangles_(kMostTriangles) {}

  /// The triangles of a tile, in the order of a depth-first walk; they last until the next call. `id` tells
  /// which diagonal the tile begins with. Nothing is allocated. Cost: a pass over the samples, and a few
  /// nanoseconds a triangle.
  std::span<const CodedTriangle> trianglesOf(const TileSamples& samples, TileId id);

 private:
  static constexpr size_t kMostTriangles = size_t{2} * kTileCellCount;
  /// Bisections from a half of the tile to a half of a cell, whose hypotenuse has no sample in its middle.
  static constexpr int kSmallest = 16;

  void closeUpwards();
  template <int kLevel>
  void walk(uint32_t apex, uint32_t left, uint32_t right);

  std::vector<SampleState> split_;  ///< Coded: here triangles are split
  const SampleState* states_ = nullptr;
  std::vector<CodedTriangle> triangles_;
  CodedTriangle* next_ = nullptr;
};

}  // namespace terrane
