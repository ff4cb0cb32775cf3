#pragma once

#include "made_meshes.h"
#include "terrane/gpu/context.h"

namespace terrane {

/// Milliseconds a frame, finishing included, medians of turns that draw one way after the other.
struct DrawingTimes {
  int64_t triangles = 0;
  double attributes = 0.0;  ///< PatchVertex records and 32-bit indices, all in one draw call
  double packed = 0.0;  ///< no attributes, the index is the vertex (10 + 10 + 12 bits); a draw call a tile
};

/// Draws about `triangles` of the meshes, of one mesh level of neighbouring finest tiles, into a picture.
/// Error: the GPU's; or the two ways draw different pictures.
Result<DrawingTimes> measureDrawing(const gpu::Context& context, const MadeMeshes& meshes, int64_t triangles,
                                    int width, int height);

}  // namespace terrane
