#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "terrane/lod/octagon.h"
#include "terrane/tiling/camera.h"
#include "terrane/tiling/frame.h"

namespace terrane {

/// An upright prism over an octagon, as the metric sees it.
struct Prism {
  glm::dvec2 center{0.0};  ///< in cells of the metric's lattice, y south
  Octagon octagon;         ///< in cells
  double low = 0.0;        ///< metres
  double high = 0.0;       ///< metres, at least `low`
};

/// How large errors inside a prism look from one camera: the bound that every choice of the `patches`
/// surface stands on (docs/architecture.md, "The metric").
///
/// All results are monotone: for a prism inside another one, with a smaller error, no result is larger. And
/// for what is in the window they are continuous functions of the camera.
class ScreenMetric {
 public:
  /// `cellMeters`: size of the lattice's cells along x and y. `toleranceWindow`: pixels by which the window
  /// is widened (the tolerance tau). `nearMeters`: nothing closer than this is drawn.
  ScreenMetric(const Camera& camera, glm::dvec2 cellMeters, double toleranceWindow, double nearMeters);

  /// How much of a prism is inside the window's frustum. May say Part for prisms just outside; what lies in
  /// a prism that is there as a whole is, too.
  enum class Sight : uint8_t { None, Part, Whole };
  Sight sight(const Prism& prism) const;
  bool visible(const Prism& prism) const { return sight(prism) != Sight::None; }

  /// How far away what is seen of a prism is: sizes on screen hang on it, several of one prism on the same.
  struct Depth {
    bool isInFront = false;  ///< some of the prism is in front of the camera
    double least = 0.0;      ///< a lower bound of the view depth of what is visible of it
  };
  Depth depth(const Prism& prism) const;
  /// Bound, in pixels, of the distance on screen between two points on one vertical inside the prism that
  /// are at most `errorMeters` apart, where at least one is in the window. Infinite where the camera is
  /// inside the prism. 0 where the prism is outside the window.
  double errorPixels(const Prism& prism, double errorMeters) const {
    return errorPixels(prism, errorMeters, depth(prism));
  }
  double errorPixels(const Prism& prism, double errorMeters, const Depth& depth) const;
  /// Bound, in pixels, of the size on screen of a horizontal length inside the prism.
  double lengthPixels(const Prism& prism, double lengthMeters) const {
    return lengthPixels(lengthMeters, depth(prism));
  }
  double lengthPixels(double lengthMeters, const Depth& depth) const;
  /// Square pixels of the picture that the prism's outline covers. For weighing, not for deciding: costs
  /// microseconds.
  double areaPixels(const Prism& prism) const;
  /// Lower bound of the distance in metres from the camera to the prism.
  double distance(const Prism& prism) const;

 private:
  struct Extent {
    double nearestDepth;  ///< smallest view depth over the prism
    double farthestDepth;
  };
  Extent depthExtent(const Prism& prism) const;
  /// Points of the tangent plane whose convex hull is the picture of the prism beyond the near plane.
  struct VisiblePoints {
    std::array<glm::dvec2, 40> tangents;
    int count = 0;
  };
  /// The corners of a prism in view coordinates: the lower ring, and the upper one.
  using Corners = std::array<std::array<glm::dvec3, 8>, 2>;
  Corners corners(const Prism& prism) const;
  bool areAllBeyondNear(const Corners& view) const;
  void findVisiblePoints(const Corners& view, VisiblePoints& out) const;

  Camera camera_;
  glm::dvec2 cellMeters_;
  double nearMeters_;
  double pixelsPerTangent_;
  glm::dvec3
      viewOfCellX_;  ///< a step of one cell along lattice x, y and of one metre up, in view coordinates
  glm::dvec3 viewOfCellY_;
  glm::dvec3 viewOfUp_;
  glm::dvec2 window_;    ///< half-size of the widened window in the tangent plane
  double cornerCosine_;  ///< cosine of the angle between the axis and the widened window's corner
  struct Plane {
    glm::dvec2 horizontal;  ///< normal over lattice x, y (cells to metres included)
    double vertical;
    double offset;
  };
  std::array<Plane, 5> planes_;  ///< inside where positive
};

}  // namespace terrane
