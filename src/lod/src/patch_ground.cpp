#include "patch_ground.h"

#include <algorithm>
#include <cstddef>

#include "terrane/lod/mesh_placement.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {

namespace {

int tileLevel(const SelectionContext& context, int bintreeLevel) {
  const int level = context.grid.tileLevel(bintreeLevel);
  return context.isMeshes ? std::min(level, context.finestLevel) : level;
}

/// Height ranges are stored for K = 17 and do not depend on K.
int rangeLevel(const SelectionContext& context, int bintreeLevel) {
  return std::min(kNodeGrid.tileLevel(bintreeLevel), context.grid.tileLevel(bintreeLevel));
}

MeshPlace meshOf(const SelectionContext& context, const KnownTiles& tiles, const Triangle& t,
                 KnownTile& tile) {
  if (tile.residency == Residency::Missing) return {Residency::Missing, &tile, {}, nullptr};
  // What is not stored is cut out of an ancestor's samples.
  KnownTile& stored = *tile.stored;
  const MeshPlacement at = meshPlacement(context.lattice, t, stored.id);
  if (at.level > kDeepestVertexLevel) return {Residency::Implied, &stored, at, nullptr};
  MeshPlace out{Residency::Resident, &stored, at, nullptr};
  if (const MeshLevel* meshes = tiles.meshesOf(stored, at.level))
    out.patch = &meshes->patches[static_cast<size_t>(at.index)];
  return out;
}

}  // namespace

PatchGround groundOf(const SelectionContext& context, KnownTiles& tiles, const Triangle& triangle,
                     const PatchGround& near) {
  const int n = triangle.diamond.level;
  PatchGround out;
  out.tile = &tiles.find(*near.tile, context.lattice.tileOf(triangle, tileLevel(context, n)));
  out.ranged = &tiles.find(*near.ranged, context.lattice.tileOf(triangle, rangeLevel(context, n)));
  if (context.isMeshes) out.mesh = meshOf(context, tiles, triangle, *out.tile);
  return out;
}

}  // namespace terrane
