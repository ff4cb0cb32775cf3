#include "terrane/tiling/camera.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace terrane {

double Camera::tanHalfY() const {
  return std::tan(0.5 * fovyRadians);
}

glm::dvec3 Camera::viewFromLocal(glm::dvec3 pointLocal) const {
  const glm::dvec3 offset = pointLocal - eyeLocal;
  return {glm::dot(offset, right), glm::dot(offset, up), glm::dot(offset, forward)};
}

glm::dvec2 Camera::pixelFromLocal(glm::dvec3 pointLocal) const {
  const glm::dvec3 view = viewFromLocal(pointLocal);
  const double scale = pixelsPerTangent() / view.z;
  return {0.5 * width + view.x * scale, 0.5 * height - view.y * scale};
}

glm::dvec3 Camera::rayThroughPixel(glm::dvec2 pixel) const {
  const double scale = 1.0 / pixelsPerTangent();
  return forward + right * ((pixel.x - 0.5 * width) * scale) + up * ((0.5 * height - pixel.y) * scale);
}

Camera lookAt(glm::dvec3 eyeLocal, glm::dvec3 targetLocal, double fovyRadians, int width, int height) {
  Camera camera;
  camera.eyeLocal = eyeLocal;
  camera.fovyRadians = fovyRadians;
  camera.width = width;
  camera.height = height;
  const glm::dvec3 direction = targetLocal - eyeLocal;
  const double distance = glm::length(direction);
  camera.forward = distance > 0.0 ? direction / distance : glm::dvec3(0.0, 1.0, 0.0);
  glm::dvec3 side = glm::cross(camera.forward, glm::dvec3(0.0, 0.0, 1.0));
  // Looking along the vertical there is no level horizon: put north (or its shadow) at the top.
  if (glm::length(side) < 1e-9) side = glm::dvec3(1.0, 0.0, 0.0);
  camera.right = glm::normalize(side);
  camera.up = glm::cross(camera.right, camera.forward);
  return camera;
}

}  // namespace terrane
