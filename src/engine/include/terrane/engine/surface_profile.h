#pragma once

#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/engine/surface.h"

namespace terrane {

/// The ground at one place of a line over it.
struct ProfilePoint {
  double distanceMeters = 0.0;  ///< along the line, over the ground's plane
  glm::dvec2 sample{0.0};       ///< sample coordinates
  size_t leg = 0;               ///< of the line: between corners `leg` and `leg + 1`
  std::optional<double> height;
  std::optional<double> errorMeters;
};

/// `count` places along a line of straight legs between `corners` (sample coordinates, at least one), at
/// equal distances, both ends included (one place: the last corner). Error: tiles that cannot be read.
Result<std::vector<ProfilePoint>> profileAlong(Surface& surface, const Frame& frame,
                                               std::span<const glm::dvec2> corners, size_t count);

/// Metres between two places in sample coordinates, over the ground's plane.
double metersBetween(const Frame& frame, glm::dvec2 a, glm::dvec2 b);

}  // namespace terrane
