#pragma once

#include <array>
#include <cstdint>
#include <glm/vec4.hpp>

#include "terrane/gpu/context.h"
#include "terrane/render/render_style.h"
#include "terrane/tiling/camera.h"
#include "terrane/tiling/frame.h"
#include "terrane/tiling/lattice.h"

namespace terrane {

/// The uniform block of shaders/frame.glsl, member for member (std140: all are 16 bytes).
struct FrameBlock {
  glm::vec4 viewRight;
  glm::vec4 viewUp;
  glm::vec4 viewForward;
  glm::vec4 place;
  glm::vec4 height;
  glm::vec4 depth;
  glm::vec4 gradient;
  glm::vec4 sunDirection;
  glm::vec4 haze;
  glm::vec4 ramp;
  glm::ivec4 style;
  glm::vec4 pixel;
  glm::vec4 imageryLight;
  std::array<glm::vec4, Palette::kMostStops> stops;
};
static_assert(sizeof(FrameBlock) == (13 + Palette::kMostStops) * 16);

/// How depth is kept: reversed, with nothing too far, where the API can; else the ordinary way.
struct DepthRange {
  bool reversed = true;
  double nearMeters = 0.1;
  double farMeters = 0.0;  ///< only for the ordinary way

  double clearDepth() const { return reversed ? 0.0 : 1.0; }
};

/// The depth range for a camera over a world.
DepthRange chooseDepthRange(const gpu::Context& context, const Frame& frame, const Camera& camera);

/// What the shaders know of a frame, but for where vertices lie: `shrink` scene pixels make a picture pixel's
/// side.
FrameBlock makeFrameBlock(const Frame& frame, const Camera& camera, const RenderStyle& style,
                          const DepthRange& depth, int shrink);

/// Fills in where vertices lie: the lattice and its anchor, from which the vertices' integers count.
void placeLattice(FrameBlock& block, const Frame& frame, const Camera& camera, double exaggeration,
                  int latticeDepth, LatticePoint anchor, int cellsPerPatchSide);

}  // namespace terrane
