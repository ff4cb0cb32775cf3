#pragma once

#include <array>
#include <vector>

#include "frame_block.h"
#include "terrane/render/render_style.h"
#include "terrane/tiling/camera.h"

namespace terrane {

/// A vertex of shaders/line.vert.
struct LineVertex {
  std::array<float, 4> clip{};
  std::array<float, 2> side{};   ///< pixels from the middle, half the width
  std::array<float, 4> color{};  ///< linear, with opacity
};
static_assert(sizeof(LineVertex) == 40);

/// The edges of another camera's field of view as triangles, seen by `camera`: four rays from its eye, the
/// window that they end at, and a smaller window on the way. `widthPixels` are pixels of the scene.
std::vector<LineVertex> makeFrustumLines(const FrustumOverlay& overlay, const Camera& camera,
                                         const DepthRange& depth, double sceneWidthPixels,
                                         double sceneHeightPixels, double widthPixels, float opacity);

}  // namespace terrane
