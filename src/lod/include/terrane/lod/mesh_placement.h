#pragma once

#include <cstdint>

#include "terrane/lod/cut.h"
#include "terrane/lod/select_patches.h"

namespace terrane {

/// The placement of a patch's mesh in a tile.
inline MeshPlacement meshPlacement(const Lattice& lattice, const Triangle& triangle, TileId tile) {
  const int shift = lattice.depth() - tile.level;
  const auto local = [&](LatticePoint p) {
    return std::array<int, 2>{(p.x >> shift) - tile.col * kTileCells, (p.y >> shift) - tile.row * kTileCells};
  };
  const int level = triangle.diamond.level - 2 * tile.level;
  if (level > kDeepestVertexLevel) return {level, -1};
  return {level, patchIndex(level, local(triangle.diamond.center()), local(triangle.apex))};
}

/// Triangles that a cut is made of, whichever its surface.
int64_t triangleCount(const Cut& cut);

}  // namespace terrane
