#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <span>
#include <vector>

#include "coded_mesh.h"

/// What a tile's mesh is, by brute force: looked at in every place.
namespace terrane {

struct Point {
  int x, y;
};
inline Point pointOf(uint32_t index) {
  return {static_cast<int>(index) % kTileSamples, static_cast<int>(index) / kTileSamples};
}
/// Twice the area of a triangle of points, positive where it is counter-clockwise with y to the south.
inline double twiceArea(double ax, double ay, double bx, double by, double cx, double cy) {
  return (cx - ax) * (by - ay) - (bx - ax) * (cy - ay);
}

/// What is shown of a mesh by looking at every place of the tile.
class Looked {
 public:
  Looked(const TileSamples& samples, std::span<const CodedTriangle> triangles)
      : samples_(samples), times_(static_cast<size_t>(4 * kTileCellCount), 0) {
    for (const CodedTriangle& triangle : triangles) look(triangle);
  }

  /// How often a quarter of a cell (0 north, 1 east, 2 south, 3 west) is covered.
  int timesCovered(int cell, int quarter) const { return times_[static_cast<size_t>(4 * cell + quarter)]; }
  double largestError() const { return largestError_; }

 private:
  void look(const CodedTriangle& triangle) {
    std::array<Point, 3> p{};
    for (size_t i = 0; i < 3; ++i) p[i] = pointOf(triangle[i]);
    const double area = twiceArea(p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y);
    ASSERT_GT(area, 0.0);
    const auto [left, right] = std::minmax({p[0].x, p[1].x, p[2].x});
    const auto [top, bottom] = std::minmax({p[0].y, p[1].y, p[2].y});
    const auto weights = [&](double x, double y) {
      return std::array<double, 3>{twiceArea(x, y, p[1].x, p[1].y, p[2].x, p[2].y) / area,
                                   twiceArea(p[0].x, p[0].y, x, y, p[2].x, p[2].y) / area,
                                   twiceArea(p[0].x, p[0].y, p[1].x, p[1].y, x, y) / area};
    };
    const auto isInside = [](const std::array<double, 3>& w) {
      return w[0] >= 0.0 && w[1] >= 0.0 && w[2] >= 0.0;
    };
    constexpr double kPlaces[4][2] = {{0.5, 0.2}, {0.8, 0.5}, {0.5, 0.8}, {0.2, 0.5}};
    for (int y = top; y < bottom; ++y) {
      for (int x = left; x < right; ++x) {
        for (size_t quarter = 0; quarter < 4; ++quarter) {
          const bool inside = isInside(weights(x + kPlaces[quarter][0], y + kPlaces[quarter][1]));
          times_[static_cast<size_t>(4 * (y * kTileCells + x)) + quarter] += inside ? 1 : 0;
        }
      }
    }
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        const auto w = weights(x, y);
        if (!isInside(w)) continue;
        double height = 0.0;
        for (size_t i = 0; i < 3; ++i) height += w[i] * double{samples_.heights[triangle[i]]};
        const double sample = samples_.heights[static_cast<size_t>(y * kTileSamples + x)];
        largestError_ = std::max(largestError_, std::abs(height - sample));
      }
    }
  }

  const TileSamples& samples_;
  std::vector<int> times_;
  double largestError_ = 0.0;
};

/// Is a corner of the mesh in the middle of some triangle's side?
inline bool hasTVertices(std::span<const CodedTriangle> triangles) {
  std::set<uint32_t> corners;
  for (const CodedTriangle& triangle : triangles) corners.insert(triangle.begin(), triangle.end());
  for (const CodedTriangle& triangle : triangles) {
    for (size_t i = 0; i < 3; ++i) {
      const Point a = pointOf(triangle[i]);
      const Point b = pointOf(triangle[(i + 1) % 3]);
      const int steps = std::max(std::abs(b.x - a.x), std::abs(b.y - a.y));
      for (int step = 1; step < steps; ++step) {
        const int x = a.x + (b.x - a.x) / steps * step;
        const int y = a.y + (b.y - a.y) / steps * step;
        if (corners.count(static_cast<uint32_t>(y * kTileSamples + x)) != 0) return true;
      }
    }
  }
  return false;
}

}  // namespace terrane
