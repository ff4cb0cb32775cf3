#pragma once

#include <cstdint>

#include "terrane/lod/select_patches.h"

namespace terrane {

/// How a cut's meshes meet, in integers: along each side that two drawn patches share.
struct MeshSeams {
  int64_t sides = 0;     ///< that two patches share
  int64_t vertices = 0;  ///< on them
  int64_t gaping = 0;    ///< sides whose vertices differ: in place, or in the drawn height's bits
  /// Sides of a patch that are half of another patch's, or twice as long: T-junctions.
  int64_t unlike = 0;
};

/// The tiles and meshes of the cut must be there. A vertex's drawn height is computed as the shader does.
MeshSeams measureMeshSeams(const Cut& cut, const ResidentTiles& tiles);

}  // namespace terrane
