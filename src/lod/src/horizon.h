#pragma once

#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "terrane/tiling/camera.h"

namespace terrane {

/// How high, at least, the ground that was added stands in each direction of a picture: what is farther away
/// and nowhere above it is not seen. As a camera sees it that stands where the picture's does and looks the
/// same way, but level: *across* is in columns from the picture's left to its right, *up* is height above the
/// eye over depth. A straight line in space is one there, too.
///
/// To begin with it is the picture's own lower side.
class Horizon {
 public:
  static constexpr int kColumns = 320;

  explicit Horizon(const Camera& camera);

  /// Is there such a camera? Not where a corner of the picture looks nearly straight down or up, or behind.
  bool isLevel() const { return columnsPerTangent_ > 0.0; }
  /// A place on the map: distance to the right, and ahead; metres.
  glm::dvec2 place(glm::dvec2 local) const {
    const glm::dvec2 from = local - eye_;
    return {from.x * right_.x + from.y * right_.y, from.x * ahead_.x + from.y * ahead_.y};
  }
  /// The same of a step on the map.
  glm::dvec2 step(glm::dvec2 local) const { return place(eye_ + local); }
  double across(double right, double oneOverAhead) const {
    return right * oneOverAhead * columnsPerTangent_ + 0.5 * kColumns;
  }

  /// A place on a line along the ground.
  struct Point {
    double across = 0.0;
    double oneOverAhead = 0.0;
  };
  /// Ground is at least so high (metres above the eye) from each place of a straight line to the next one.
  /// One height less than places.
  void raise(std::span<const Point> line, std::span<const float> heights);
  /// Is what lies between two directions, and is nowhere higher than `up`, below the horizon all along?
  bool hides(double firstAcross, double lastAcross, double up) const;

 private:
  void raiseToPicture(const Camera& camera);

  /// What is known of a part of a column only: from its left side on, and up to its right side.
  struct Parts {
    float leftUp, leftEnd;
    float rightUp, rightBegin;
  };
  /// Up to an end, or from a beginning on.
  void raiseLeftPart(int column, float end, float up);
  void raiseRightPart(int column, float begin, float up);

  glm::dvec2 eye_;
  glm::dvec2 ahead_{0.0};
  glm::dvec2 right_{0.0};
  double columnsPerTangent_ = 0.0;
  double marginUp_;
  std::vector<float> up_;  ///< of whole columns
  std::vector<Parts> parts_;
};

}  // namespace terrane
