#pragma once

#include <cstdint>

#include "terrane/lod/cut.h"
#include "terrane/lod/select_patches.h"

namespace terrane {

/// Where a patch's mesh is in the tile that it is cut out of: which mesh level, and which patch of it.
struct MeshPlacement {
  int level = 0;
  int index = 0;  ///< meaningful for level <= kDeepestVertexLevel only
};
inline MeshPlacement meshPlacement(const Lattice& lattice, const Triangle& triangle, TileId tile) {
  const int shift = lattice.depth() - tile.level;
  const auto local = [&](LatticePoint p) {
    return std::array<int, 2>{(p.x >> shift) - tile.col * kTileCells, (p.y >> shift) - tile.row * kTileCells};
  };
  const int level = triangle.diamond.level - 2 * tile.level;
  if (level > kDeepestVertexLevel) return {level, -1};
  return {level, patchIndex(level, local(triangle.diamond.center()), local(triangle.apex))};
}

/// Triangles that a cut is made of, whichever its surface; its tiles and meshes must be there.
int64_t triangleCount(const Cut& cut, const ResidentTiles& tiles);

}  // namespace terrane
