#include "horizon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace terrane {

namespace {

/// A horizon counts for so many pixels less than it is: room for what the GPU rounds.
constexpr double kMarginPixels = 0.1;
/// Directions are as exact as so many columns.
constexpr float kExactColumns = 1e-4F;
/// The farthest from ahead that a corner of the picture may look: a tangent.
constexpr double kWidestTangent = 8.0;

}  // namespace

Horizon::Horizon(const Camera& camera)
    : eye_(camera.eyeLocal), marginUp_(kMarginPixels / camera.pixelsPerTangent()) {
  const glm::dvec2 forward(camera.forward);
  const double length = glm::length(forward);
  if (length < 1.0 / kWidestTangent) return;
  ahead_ = forward / length;
  right_ = {ahead_.y, -ahead_.x};
  double widest = 0.0;
  for (const double x : {-camera.tanHalfX(), camera.tanHalfX()}) {
    for (const double y : {-camera.tanHalfY(), camera.tanHalfY()}) {
      const glm::dvec2 ray(camera.forward + x * camera.right + y * camera.up);
      const double depth = glm::dot(ray, ahead_), across = std::abs(glm::dot(ray, right_));
      if (!(across < kWidestTangent * depth)) return;
      widest = std::max(widest, across / depth);
    }
  }
  // A little more than the picture, so that what is beyond lies outside.
  columnsPerTangent_ = 0.5 * kColumns / (1.001 * widest);
  constexpr float kNothing = -std::numeric_limits<float>::infinity();
  up_.assign(kColumns, kNothing);
  parts_.assign(kColumns, {kNothing, 0.0F, kNothing, 1.0F});
  raiseToPicture(camera);
}

void Horizon::raiseToPicture(const Camera& camera) {
  // Planes through the eye and a side of the picture, a pixel wider. Inside is (across, up, 1) * normal >= 0.
  const double pixel = 1.0 / camera.pixelsPerTangent();
  const double x = camera.tanHalfX() + pixel, y = camera.tanHalfY() + pixel;
  const std::array<glm::dvec3, 4> normals = {camera.forward * x - camera.right,
                                             camera.forward * x + camera.right,
                                             camera.forward * y - camera.up, camera.forward * y + camera.up};
  for (const glm::dvec3& normal : normals) {
    if (normal.z < 1e-3) continue;
    const double across = glm::dot(glm::dvec2(normal), right_), ahead = glm::dot(glm::dvec2(normal), ahead_);
    const double slope = -across / (columnsPerTangent_ * normal.z);
    const double middle = -ahead / normal.z - marginUp_;
    for (int column = 0; column < kColumns; ++column) {
      const double left = column - 0.5 * kColumns;
      float& up = up_[static_cast<size_t>(column)];
      up = std::max(up, static_cast<float>(middle + slope * (slope > 0.0 ? left : left + 1.0)));
    }
  }
}

void Horizon::raise(std::span<const Point> line, std::span<const float> heights) {
  if (line.empty()) return;
  const bool isReverse = line.front().across > line.back().across;
  const auto at = [&](size_t i) { return isReverse ? line.size() - 1 - i : i; };
  const auto margin = static_cast<float>(marginUp_);
  constexpr auto kEnd = static_cast<float>(kColumns);

  // Of the column that the line is in: from where on it is known, and how low it gets there.
  int column = 0;
  float begin = 1.0F, low = std::numeric_limits<float>::infinity();
  bool isIn = false;
  float end = 0.0F;
  for (size_t i = 0; i + 1 < line.size(); ++i) {
    const Point &p = line[at(i)], &q = line[at(i + 1)];
    const float height = heights[isReverse ? at(i + 1) : i];
    float from = static_cast<float>(p.across), fromUp = height * static_cast<float>(p.oneOverAhead) - margin;
    end = std::min(static_cast<float>(q.across), kEnd);
    const float endUp = height * static_cast<float>(q.oneOverAhead) - margin;
    if (end <= 0.0F || from >= kEnd) continue;
    const float slope = (endUp - fromUp) / std::max(static_cast<float>(q.across) - from, 1e-6F);
    const float base = fromUp - slope * from;
    if (from < 0.0F) {
      from = 0.0F;
      fromUp = base;
    }
    if (!isIn) {
      isIn = true;
      column = static_cast<int>(from);
      begin = from - static_cast<float>(column);
    }
    low = std::min(low, fromUp);
    const int last = static_cast<int>(end);
    if (last > column) {
      // The rest of this column, those in between, and the first part of the last one.
      low = std::min(low, base + slope * static_cast<float>(column + 1));
      if (begin <= kExactColumns)
        up_[static_cast<size_t>(column)] = std::max(up_[static_cast<size_t>(column)], low);
      else
        raiseRightPart(column, begin, low);
      const float lower = slope > 0.0F ? base : base + slope;
      for (int between = column + 1; between < last; ++between) {
        float& up = up_[static_cast<size_t>(between)];
        up = std::max(up, lower + slope * static_cast<float>(between));
      }
      column = last;
      begin = 0.0F;
      low = base + slope * static_cast<float>(last);
    }
    low = std::min(low, std::min(endUp, base + slope * end));
    if (column >= kColumns) return;
  }
  if (isIn && begin <= kExactColumns) raiseLeftPart(column, end - static_cast<float>(column), low);
}

void Horizon::raiseLeftPart(int column, float end, float up) {
  Parts& at = parts_[static_cast<size_t>(column)];
  float& whole = up_[static_cast<size_t>(column)];
  // Where two lines meet, the lower one of both counts.
  if (at.rightBegin <= end + kExactColumns) whole = std::max(whole, std::min(up, at.rightUp));
  if (up > at.leftUp || end > at.leftEnd) {
    at.leftUp = up;
    at.leftEnd = end;
  }
}

void Horizon::raiseRightPart(int column, float begin, float up) {
  Parts& at = parts_[static_cast<size_t>(column)];
  float& whole = up_[static_cast<size_t>(column)];
  if (at.leftEnd >= begin - kExactColumns) whole = std::max(whole, std::min(up, at.leftUp));
  if (up > at.rightUp || begin < at.rightBegin) {
    at.rightUp = up;
    at.rightBegin = begin;
  }
}

bool Horizon::hides(double firstAcross, double lastAcross, double up) const {
  if (lastAcross < 0.0 || firstAcross > kColumns) return true;
  const int first = std::max(static_cast<int>(firstAcross - static_cast<double>(kExactColumns)), 0);
  const int last = std::min(static_cast<int>(lastAcross + static_cast<double>(kExactColumns)), kColumns - 1);
  const auto limit = static_cast<float>(up);
  for (int column = first; column <= last; ++column)
    if (up_[static_cast<size_t>(column)] < limit) return false;
  return true;
}

}  // namespace terrane
