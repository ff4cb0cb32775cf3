#include "terrane/lod/screen_metric.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <vector>

namespace terrane {

namespace {

/// A direction of local space as a linear form over lattice x and y (y points south there).
glm::dvec2 overCells(glm::dvec3 direction, glm::dvec2 cellMeters) {
  return {direction.x * cellMeters.x, -direction.y * cellMeters.y};
}

using Polygon = std::vector<glm::dvec2>;

double cross(glm::dvec2 a, glm::dvec2 b) {
  return a.x * b.y - a.y * b.x;
}

/// Counter-clockwise, without collinear points (Andrew 1979).
Polygon convexHull(Polygon points) {
  if (points.size() < 3) return {};
  std::sort(points.begin(), points.end(),
            [](glm::dvec2 a, glm::dvec2 b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  Polygon hull;
  for (const bool upper : {false, true}) {
    const size_t first = hull.size();
    for (const glm::dvec2 p : points) {
      while (hull.size() >= first + 2 && cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0.0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    if (!upper) std::reverse(points.begin(), points.end());
  }
  return hull;
}

/// The part of a convex polygon with sign * p[axis] <= most.
Polygon clipped(const Polygon& polygon, int axis, double sign, double most) {
  Polygon out;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec2 p = polygon[i], q = polygon[(i + 1) % polygon.size()];
    const double a = most - sign * p[axis], b = most - sign * q[axis];
    if (a >= 0.0) out.push_back(p);
    if ((a >= 0.0) != (b >= 0.0)) out.push_back(p + (q - p) * (a / (a - b)));
  }
  return out;
}

double area(const Polygon& polygon) {
  double twice = 0.0;
  for (size_t i = 0; i < polygon.size(); ++i) twice += cross(polygon[i], polygon[(i + 1) % polygon.size()]);
  return 0.5 * twice;
}

}  // namespace

ScreenMetric::ScreenMetric(const Camera& camera, glm::dvec2 cellMeters, double toleranceWindow,
                           double nearMeters)
    : camera_(camera),
      cellMeters_(cellMeters),
      nearMeters_(nearMeters),
      pixelsPerTangent_(camera.pixelsPerTangent()),
      viewOfCellX_(glm::dvec3(camera.right.x, camera.up.x, camera.forward.x) * cellMeters.x),
      viewOfCellY_(glm::dvec3(camera.right.y, camera.up.y, camera.forward.y) * -cellMeters.y),
      viewOfUp_(camera.right.z, camera.up.z, camera.forward.z) {
  const double margin = toleranceWindow / pixelsPerTangent_;
  window_ = {camera.tanHalfX() + margin, camera.tanHalfY() + margin};
  cornerCosine_ = 1.0 / std::sqrt(1.0 + window_.x * window_.x + window_.y * window_.y);
  const std::array<glm::dvec3, 5> normals = {
      camera.forward * window_.x - camera.right, camera.forward * window_.x + camera.right,
      camera.forward * window_.y - camera.up, camera.forward * window_.y + camera.up, camera.forward};
  for (size_t i = 0; i < normals.size(); ++i)
    planes_[i] = {overCells(normals[i], cellMeters), normals[i].z, -glm::dot(normals[i], camera.eyeLocal)};
}

ScreenMetric::Sight ScreenMetric::sight(const Prism& prism) const {
  Sight out = Sight::Whole;
  for (const Plane& plane : planes_) {
    const double middle = glm::dot(plane.horizontal, prism.center);
    const double reach = prism.octagon.support(plane.horizontal);
    const double a = plane.vertical * prism.low, b = plane.vertical * prism.high;
    if (middle + reach + std::max(a, b) + plane.offset < 0.0) return Sight::None;
    if (middle - reach + std::min(a, b) + plane.offset < 0.0) out = Sight::Part;
  }
  return out;
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
  return std::sqrt(horizontal * horizontal + vertical * vertical);
}

ScreenMetric::Depth ScreenMetric::depth(const Prism& prism) const {
  const Extent extent = depthExtent(prism);
  if (extent.farthestDepth < 0.0) return {};
  return {true, std::max({extent.nearestDepth, distance(prism) * cornerCosine_, 0.0})};
}

ScreenMetric::Corners ScreenMetric::corners(const Prism& prism) const {
  // The corners stand at sums of a few steps from the middle: no product for each.
  const double a = prism.octagon.extent, b = prism.octagon.inner();
  const glm::dvec3 middle =
      camera_.viewFromLocal({prism.center.x * cellMeters_.x, -prism.center.y * cellMeters_.y, prism.low});
  const glm::dvec3 ax = a * viewOfCellX_, bx = b * viewOfCellX_, ay = a * viewOfCellY_, by = b * viewOfCellY_;
  const glm::dvec3 rise = (prism.high - prism.low) * viewOfUp_;
  Corners view;
  view[0] = {{middle + ax + by, middle + bx + ay, middle - bx + ay, middle - ax + by, middle - ax - by,
              middle - bx - ay, middle + bx - ay, middle + ax - by}};
  for (size_t i = 0; i < view[0].size(); ++i) view[1][i] = view[0][i] + rise;
  return view;
}

bool ScreenMetric::areAllBeyondNear(const Corners& view) const {
  for (const auto& ring : view)
    for (const glm::dvec3& p : ring)
      if (!(p.z >= nearMeters_)) return false;
  return true;
}

void ScreenMetric::findVisiblePoints(const Corners& view, VisiblePoints& out) const {
  // The corners in front of the near plane, and where edges pass through it: as the prism moves through the
  // plane, they move, they do not jump.
  const auto add = [&](const glm::dvec3& p) {
    out.tangents[static_cast<size_t>(out.count++)] = {p.x / p.z, p.y / p.z};
  };
  const auto cross = [&](const glm::dvec3& p, const glm::dvec3& q) {
    if ((p.z >= nearMeters_) == (q.z >= nearMeters_)) return;
    const double t = (nearMeters_ - p.z) / (q.z - p.z);
    add({p.x + t * (q.x - p.x), p.y + t * (q.y - p.y), nearMeters_});
  };
  const size_t corners = view[0].size();
  for (size_t i = 0; i < corners; ++i) {
    for (size_t ring = 0; ring < 2; ++ring) {
      if (view[ring][i].z >= nearMeters_) add(view[ring][i]);
      cross(view[ring][i], view[ring][(i + 1) % corners]);
    }
    cross(view[0][i], view[1][i]);
  }
}

double ScreenMetric::errorPixels(const Prism& prism, double errorMeters, const Depth& depth) const {
  if (errorMeters <= 0.0 || !depth.isInFront) return 0.0;

  // The part of the window that the prism can be seen in.
  const double inf = std::numeric_limits<double>::infinity();
  glm::dvec2 low{inf}, high{-inf};
  const auto add = [&](double x, double y) {
    low = {std::min(low.x, x), std::min(low.y, y)};
    high = {std::max(high.x, x), std::max(high.y, y)};
  };
  const Corners view = corners(prism);
  if (areAllBeyondNear(view)) {
    for (const auto& ring : view)
      for (const glm::dvec3& p : ring) add(p.x / p.z, p.y / p.z);
  } else {
    VisiblePoints points;
    findVisiblePoints(view, points);
    for (int i = 0; i < points.count; ++i) {
      const glm::dvec2& tangent = points.tangents[static_cast<size_t>(i)];
      add(tangent.x, tangent.y);
    }
  }
  low = {std::max(low.x, -window_.x), std::max(low.y, -window_.y)};
  high = {std::min(high.x, window_.x), std::min(high.y, window_.y)};
  if (low.x > high.x || low.y > high.y) return 0.0;

  // A vertical step e moves a point by e * |up_xy - tangent * up_z| / depth: convex over the window, so its
  // largest value stands at a corner of the visible part.
  const glm::dvec3& up = viewOfUp_;
  double steepest = 0.0;
  for (const double x : {low.x, high.x}) {
    for (const double y : {low.y, high.y}) {
      const glm::dvec2 step{up.x - x * up.z, up.y - y * up.z};
      steepest = std::max(steepest, glm::dot(step, step));
    }
  }
  return pixelsPerTangent_ * std::sqrt(steepest) * errorMeters / depth.least;
}

double ScreenMetric::areaPixels(const Prism& prism) const {
  VisiblePoints points;
  findVisiblePoints(corners(prism), points);
  Polygon hull = convexHull({points.tangents.begin(), points.tangents.begin() + points.count});
  const glm::dvec2 window{camera_.tanHalfX(), camera_.tanHalfY()};
  for (const int axis : {0, 1})
    for (const double sign : {1.0, -1.0}) hull = clipped(hull, axis, sign, window[axis]);
  return area(hull) * pixelsPerTangent_ * pixelsPerTangent_;
}

double ScreenMetric::lengthPixels(double lengthMeters, const Depth& depth) const {
  return depth.isInFront ? pixelsPerTangent_ * lengthMeters / depth.least : 0.0;
}

}  // namespace terrane
