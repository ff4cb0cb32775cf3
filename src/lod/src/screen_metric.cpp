#include "terrane/lod/screen_metric.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace terrane {

namespace {

/// A direction of local space as a linear form over lattice x and y (y points south there).
glm::dvec2 overCells(glm::dvec3 direction, glm::dvec2 cellMeters) {
  return {direction.x * cellMeters.x, -direction.y * cellMeters.y};
}

}  // namespace

ScreenMetric::ScreenMetric(const Camera& camera, glm::dvec2 cellMeters, double toleranceWindow,
                           double nearMeters)
    : camera_(camera),
      cellMeters_(cellMeters),
      nearMeters_(nearMeters),
      pixelsPerTangent_(camera.pixelsPerTangent()) {
  const double margin = toleranceWindow / pixelsPerTangent_;
  window_ = {camera.tanHalfX() + margin, camera.tanHalfY() + margin};
  cornerCosine_ = 1.0 / std::sqrt(1.0 + window_.x * window_.x + window_.y * window_.y);
  const std::array<glm::dvec3, 5> normals = {
      camera.forward * window_.x - camera.right, camera.forward * window_.x + camera.right,
      camera.forward * window_.y - camera.up, camera.forward * window_.y + camera.up, camera.forward};
  for (size_t i = 0; i < normals.size(); ++i)
    planes_[i] = {overCells(normals[i], cellMeters), normals[i].z, -glm::dot(normals[i], camera.eyeLocal)};
}

bool ScreenMetric::visible(const Prism& prism) const {
  for (const Plane& plane : planes_) {
    const double highest = glm::dot(plane.horizontal, prism.center) +
                           prism.octagon.support(plane.horizontal) +
                           std::max(plane.vertical * prism.low, plane.vertical * prism.high) + plane.offset;
    if (highest < 0.0) return false;
  }
  return true;
}

ScreenMetric::Extent ScreenMetric::depthExtent(const Prism& prism) const {
  const glm::dvec2 n = overCells(camera_.forward, cellMeters_);
  const double middle = glm::dot(n, prism.center) - glm::dot(camera_.forward, camera_.eyeLocal);
  const double reach = prism.octagon.support(n);
  const double a = camera_.forward.z * prism.low, b = camera_.forward.z * prism.high;
  return {middle - reach + std::min(a, b), middle + reach + std::max(a, b)};
}

double ScreenMetric::distance(const Prism& prism) const {
  const glm::dvec2 eye{camera_.eyeLocal.x / cellMeters_.x, -camera_.eyeLocal.y / cellMeters_.y};
  // Cells may be a per cent wider than high: the smaller side keeps this a lower bound.
  const double horizontal =
      prism.octagon.distance(eye - prism.center) * std::min(cellMeters_.x, cellMeters_.y);
  const double vertical = std::max({0.0, prism.low - camera_.eyeLocal.z, camera_.eyeLocal.z - prism.high});
  return std::hypot(horizontal, vertical);
}

double ScreenMetric::visibleDepth(const Prism& prism, double nearestDepth) const {
  return std::max({nearestDepth, distance(prism) * cornerCosine_, 0.0});
}

double ScreenMetric::errorPixels(const Prism& prism, double errorMeters) const {
  if (errorMeters <= 0.0) return 0.0;
  const Extent depth = depthExtent(prism);
  if (depth.farthestDepth < 0.0) return 0.0;

  // The part of the window that the prism can be seen in: all of it where the prism reaches the camera.
  glm::dvec2 low = -window_, high = window_;
  if (depth.nearestDepth > nearMeters_) {
    const double inf = std::numeric_limits<double>::infinity();
    glm::dvec2 seenLow{inf}, seenHigh{-inf};
    const double a = prism.octagon.extent, b = prism.octagon.inner();
    const std::array<glm::dvec2, 8> corners = {
        {{a, b}, {a, -b}, {-a, b}, {-a, -b}, {b, a}, {b, -a}, {-b, a}, {-b, -a}}};
    for (const glm::dvec2& corner : corners) {
      const glm::dvec2 cell = prism.center + corner;
      for (const double height : {prism.low, prism.high}) {
        const glm::dvec3 view =
            camera_.viewFromLocal({cell.x * cellMeters_.x, -cell.y * cellMeters_.y, height});
        const glm::dvec2 tangent{view.x / view.z, view.y / view.z};
        seenLow = {std::min(seenLow.x, tangent.x), std::min(seenLow.y, tangent.y)};
        seenHigh = {std::max(seenHigh.x, tangent.x), std::max(seenHigh.y, tangent.y)};
      }
    }
    low = {std::max(low.x, seenLow.x), std::max(low.y, seenLow.y)};
    high = {std::min(high.x, seenHigh.x), std::min(high.y, seenHigh.y)};
    if (low.x > high.x || low.y > high.y) return 0.0;
  }

  // A vertical step e moves a point by e * |up_xy - tangent * up_z| / depth: convex over the window, so its
  // largest value stands at a corner of the visible part.
  const glm::dvec3 up{camera_.right.z, camera_.up.z, camera_.forward.z};
  double steepest = 0.0;
  for (const double x : {low.x, high.x})
    for (const double y : {low.y, high.y})
      steepest = std::max(steepest, std::hypot(up.x - x * up.z, up.y - y * up.z));
  return pixelsPerTangent_ * steepest * errorMeters / visibleDepth(prism, depth.nearestDepth);
}

double ScreenMetric::lengthPixels(const Prism& prism, double lengthMeters) const {
  const Extent depth = depthExtent(prism);
  if (depth.farthestDepth < 0.0) return 0.0;
  return pixelsPerTangent_ * lengthMeters / visibleDepth(prism, depth.nearestDepth);
}

}  // namespace terrane
