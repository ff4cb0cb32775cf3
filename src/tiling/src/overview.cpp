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

  // Along the viewing direction every corner gives the least distance at which it is inside the picture; the
  // eye also slides across so that the ground sits in the middle.
  const double tanX = camera.tanHalfX() * kFill, tanY = camera.tanHalfY() * kFill;
  glm::dvec3 aim = middle;
  double distance = 1.0;
  for (int pass = 0; pass < 8; ++pass) {
    distance = 1e-6;
    for (const glm::dvec3& corner : cornersOf(ground)) {
      const glm::dvec3 offset = corner - aim;
      const double depth = glm::dot(offset, camera.forward);
      const double across = std::max(std::abs(glm::dot(offset, camera.right)) / tanX,
                                     std::abs(glm::dot(offset, camera.up)) / tanY);
      distance = std::max(distance, across - depth);
    }
    glm::dvec2 low(1e300), high(-1e300);
    for (const glm::dvec3& corner : cornersOf(ground)) {
      const glm::dvec3 offset = corner - aim;
      const double depth = glm::dot(offset, camera.forward) + distance;
      const glm::dvec2 tangent(glm::dot(offset, camera.right) / depth, glm::dot(offset, camera.up) / depth);
      low = {std::min(low.x, tangent.x), std::min(low.y, tangent.y)};
      high = {std::max(high.x, tangent.x), std::max(high.y, tangent.y)};
    }
    const glm::dvec2 shift = 0.5 * (low + high) * distance;
    aim += camera.right * shift.x + camera.up * shift.y;
  }
  camera.eyeLocal = aim - camera.forward * distance;
  return camera;
}

}  // namespace terrane
