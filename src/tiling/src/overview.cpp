#include "terrane/tiling/overview.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

namespace terrane {

namespace {

/// Share of the picture's half-width and half-height that the ground may fill.
constexpr double kFill = 0.94;

std::array<glm::dvec3, 8> cornersOf(const GroundBox& box) {
  std::array<glm::dvec3, 8> out;
  for (size_t i = 0; i < 8; ++i)
    out[i] = {(i & 1) ? box.high.x : box.low.x, (i & 2) ? box.high.y : box.low.y,
              (i & 4) ? box.high.z : box.low.z};
  return out;
}

}  // namespace

Camera overviewCamera(const GroundBox& ground, double azimuthDegrees, double elevationDegrees,
                      double fovyRadians, int width, int height) {
  const double radians = std::acos(-1.0) / 180.0;
  const double azimuth = azimuthDegrees * radians, elevation = std::min(elevationDegrees, 90.0) * radians;
  const glm::dvec3 towardsEye(std::cos(elevation) * std::sin(azimuth),
                              std::cos(elevation) * std::cos(azimuth), std::sin(elevation));
  const glm::dvec3 middle = 0.5 * (ground.low + ground.high);
  // note: straight down, lookAt() puts north at the top whatever the azimuth.
  Camera camera = lookAt(middle + towardsEye, middle, fovyRadians, width, height);

  // A corner at r to the right and d deep is inside a wedge of slope t whose tip stands at a, D before the
  // middle, when |r - a| <= t (d + D). All corners together give the least D, and the range of a.
  const auto wedge = [&](const glm::dvec3& axis, double slope) {
    double left = -1e300, right = 1e300;
    for (const glm::dvec3& corner : cornersOf(ground)) {
      const double r = glm::dot(corner - middle, axis), d = glm::dot(corner - middle, camera.forward);
      left = std::max(left, r - slope * d);
      right = std::min(right, r + slope * d);
    }
    return glm::dvec2(left, right);
  };
  const double tanX = camera.tanHalfX() * kFill, tanY = camera.tanHalfY() * kFill;
  const glm::dvec2 across = wedge(camera.right, tanX), along = wedge(camera.up, tanY);
  const double distance = std::max((across.x - across.y) / (2.0 * tanX), (along.x - along.y) / (2.0 * tanY));

  // From there, as much room on one side of the ground as on the other: what one is at falls as the eye
  // moves.
  const double reach = glm::length(ground.high - middle);
  const auto centered = [&](const glm::dvec3& axis) {
    double low = -reach, high = reach;
    for (int turn = 0; turn < 60; ++turn) {
      const double offset = 0.5 * (low + high);
      double least = 1e300, most = -1e300;
      for (const glm::dvec3& corner : cornersOf(ground)) {
        const double slope = (glm::dot(corner - middle, axis) - offset) /
                             (glm::dot(corner - middle, camera.forward) + distance);
        least = std::min(least, slope);
        most = std::max(most, slope);
      }
      (least + most > 0.0 ? low : high) = offset;
    }
    return 0.5 * (low + high);
  };
  camera.eyeLocal = middle - camera.forward * distance + camera.right * centered(camera.right) +
                    camera.up * centered(camera.up);
  return camera;
}

}  // namespace terrane
