#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <vector>

namespace terrane {

/// A line that lies on the ground: straight legs between corners, round where they meet and at the ends. A
/// plain value.
struct GroundLine {
  std::vector<glm::dvec2> corners;         ///< local coordinates; one corner alone is a dot
  std::array<float, 4> srgba{1, 1, 1, 1};  ///< as in a picture's pixels, and opacity; 0 to 1
  double width = 3.0;                      ///< in pixels of the picture, or in metres on the ground; above 0
  bool isWidthInMeters = false;
};

}  // namespace terrane
