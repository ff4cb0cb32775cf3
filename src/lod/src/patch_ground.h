#pragma once

#include "known_tiles.h"
#include "selection_context.h"
#include "terrane/codec/mesh_level.h"
#include "terrane/lod/cut.h"
#include "terrane/tiling/lattice.h"

namespace terrane {

/// A patch's mesh.
struct MeshPlace {
  Residency residency = Residency::Missing;  ///< Implied: so deep that there is nothing to be cut any more
  KnownTile* tile = nullptr;                 ///< that is or would be read; where Missing, the one to wish for
  MeshPlacement at;
  const MeshLevel::Patch* patch = nullptr;  ///< null where it is not made
};

/// What a triangle is made of.
struct PatchGround {
  KnownTile* tile = nullptr;    ///< whose samples its patch is of
  KnownTile* ranged = nullptr;  ///< whose nodes know its height range: the same, or an ancestor
  MeshPlace mesh;               ///< for SurfaceKind::Meshes

  /// Of a patch that is made: all that may be drawn are.
  double meshErrorMeters() const {
    return mesh.patch != nullptr ? static_cast<double>(mesh.patch->errorMeters) : 0.0;
  }
};

/// A triangle's ground, near that of another one.
PatchGround groundOf(const SelectionContext& context, KnownTiles& tiles, const Triangle& triangle,
                     const PatchGround& near);

}  // namespace terrane
