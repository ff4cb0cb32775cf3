#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "terrane/measure/drawn_surface.h"
#include "terrane/tiling/camera.h"

namespace terrane {

/// What of a picture moved by itself, not because the camera did: for each pixel the point of the ground
/// under it, where it was drawn in the frame before and where it is drawn now, both seen by the camera of
/// now.
struct PopMeasure {
  int64_t pixels = 0;     ///< whose point is in the window in both frames
  int64_t aboveHalf = 0;  ///< of these, those that popped by more than half a pixel
  double maxPixels = 0.0;
  glm::dvec3 maxPoint{0.0};
  int64_t missing =
      0;  ///< points in the window that the frame before did not draw: none, or something is wrong
  double offSurface = 0.0;  ///< largest distance in pixels between a place and the surface evaluated there

  /// What 99.9 % of the pixels stay below, to a thousandth of a pixel.
  double percentile999() const;
  void add(const PopMeasure& other);
  static constexpr int kBinsPerPixel = 1000;
  std::vector<int64_t> histogram;
};

/// One frame of a flight: its camera and what it draws.
struct DrawnFrame {
  const Camera& camera;
  const DrawnSurface& surface;
};

/// `places`: the place under each pixel of `now` (rows from the top, NaN for sky), heights not exaggerated.
/// On all cores.
PopMeasure measurePops(const DrawnFrame& before, const DrawnFrame& now, std::span<const glm::dvec3> places);

}  // namespace terrane
