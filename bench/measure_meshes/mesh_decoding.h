#pragma once

#include "stored_pyramid.h"

namespace terrane {

/// What decoding a whole pyramid to meshes costs in one thread.
struct MeshDecoding {
  int64_t tiles = 0;
  int64_t triangles = 0;  ///< of all tiles, on all levels
  double seconds = 0.0;   ///< CPU time: entropy decoding, samples, and the list of triangles
};

/// The median of five turns, each over all tiles.
Result<MeshDecoding> measureMeshDecoding(const StoredPyramid& pyramid);

}  // namespace terrane
