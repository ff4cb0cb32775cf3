#include "quadtree_mesh.h"

#include <cmath>
#include <cstdlib>
#include <utility>

namespace terrane {

namespace {

struct Sample {
  int x;
  int y;
};

class Refinement {
 public:
  Refinement(const StripHeights& heights, int side, double boundMeters)
      : heights_(heights), side_(side), bound_(boundMeters), isSplit_(heights.q.size(), 0) {}

  std::vector<uint8_t> run() {
    const int middle = side_ / 2;
    mark({middle, middle});
    // Each triangle is looked at once, when the split that makes it has been marked. What is found to be
    // too far off is split, whatever order they come in: the mesh does not depend on it.
    while (!pending_.empty()) {
      const Sample apex = pending_.back();
      pending_.pop_back();
      const int s = lowestBit(apex);
      if (isQuadCentre(apex, s)) {
        for (const int sign : {-1, 1}) {
          lookAt({apex.x + sign * s, apex.y}, [&] { return fitsSideways(apex, s, sign); });
          lookAt({apex.x, apex.y + sign * s}, [&] { return fitsUpright(apex, s, sign); });
        }
      } else if (s >= 2) {
        for (const int signX : {-1, 1}) {
          for (const int signY : {-1, 1}) {
            lookAt({apex.x + signX * s / 2, apex.y + signY * s / 2},
                   [&] { return fitsCorner(apex, s, signX, signY); });
          }
        }
      }
    }
    return std::move(isSplit_);
  }

 private:
  static int lowestBit(Sample p) { return (p.x | p.y) & -(p.x | p.y); }
  static bool isQuadCentre(Sample p, int s) { return (p.x & p.y & s) != 0; }
  bool inside(Sample p) const { return p.x >= 0 && p.y >= 0 && p.x < side_ && p.y < side_; }
  size_t indexOf(int x, int y) const { return static_cast<size_t>(y) * static_cast<size_t>(side_) + x; }
  double qAt(int x, int y) const { return heights_.q[indexOf(x, y)]; }

  void mark(Sample midpoint) {
    isSplit_[indexOf(midpoint.x, midpoint.y)] = 1;
    pending_.push_back(midpoint);
  }

  /// Splits here, after the splits that this one needs.
  void split(Sample midpoint) {
    if (!inside(midpoint) || isSplit_[indexOf(midpoint.x, midpoint.y)] != 0) return;
    const auto [x, y] = midpoint;
    const int s = lowestBit(midpoint);
    if (isQuadCentre(midpoint, s)) {
      // The hypotenuse's ends are the corners with an even sum, in units of the square's side.
      const bool northWestIsEnd = ((x - s + y - s) / (2 * s)) % 2 == 0;
      split({northWestIsEnd ? x + s : x - s, y - s});
      split({northWestIsEnd ? x - s : x + s, y + s});
    } else if ((x & s) != 0) {
      split({x, y - s});
      split({x, y + s});
    } else {
      split({x - s, y});
      split({x + s, y});
    }
    mark(midpoint);
  }

  /// Splits the triangle with that midpoint unless it fits.
  template <class Fits>
  void lookAt(Sample midpoint, const Fits& fits) {
    if (inside(midpoint) && isSplit_[indexOf(midpoint.x, midpoint.y)] == 0 && !fits()) split(midpoint);
  }

  /// Are `count` samples of a row from (x, y) eastwards near enough to q + i * perSample?
  /// note: q and perSample are multiples of 1 / 1024 below 2^13, so that the sums are exact.
  bool rowFits(int x, int y, int count, double q, double perSample) const {
    const float* row = heights_.known.data() + indexOf(x, y);
    const double base = heights_.baseMeters;
    const double step = heights_.stepMeters;
    unsigned misses = 0;
    for (int i = 0; i < count; ++i)
      misses |= std::abs(base + (q + i * perSample) * step - row[i]) > bound_ ? 1U : 0U;
    return misses == 0;
  }

  // Whether triangles fit, by where their hypotenuse lies as seen from the right angle. The midpoint comes
  // first in each: it is the likeliest to miss.

  /// Hypotenuse from north to south, s to the east or west.
  bool fitsSideways(Sample apex, int s, int sign) const {
    const int far = apex.x + sign * s;
    const double north = qAt(far, apex.y - s);
    const double south = qAt(far, apex.y + s);
    const double middle = (north + south) / 2.0;
    if (!rowFits(far, apex.y, 1, middle, 0.0)) return false;
    const double perX = sign * (middle - qAt(apex.x, apex.y)) / s;
    const double perY = (south - north) / (2.0 * s);
    for (int j = -s; j <= s; ++j) {
      const int count = s - std::abs(j) + 1;
      const int west = sign > 0 ? far - count + 1 : far;
      if (!rowFits(west, apex.y + j, count, middle + (west - far) * perX + j * perY, perX)) return false;
    }
    return true;
  }

  /// Hypotenuse from west to east, s to the south or north.
  bool fitsUpright(Sample apex, int s, int sign) const {
    const int far = apex.y + sign * s;
    const double west = qAt(apex.x - s, far);
    const double east = qAt(apex.x + s, far);
    const double middle = (west + east) / 2.0;
    if (!rowFits(apex.x, far, 1, middle, 0.0)) return false;
    const double top = qAt(apex.x, apex.y);
    const double perX = (east - west) / (2.0 * s);
    const double perRow = (middle - top) / s;
    for (int i = s; i >= 0; --i) {
      if (!rowFits(apex.x - i, apex.y + sign * i, 2 * i + 1, top + i * perRow - i * perX, perX)) return false;
    }
    return true;
  }

  /// Hypotenuse across, from s to the east or west to s to the south or north.
  bool fitsCorner(Sample apex, int s, int signX, int signY) const {
    const double top = qAt(apex.x, apex.y);
    const double perX = signX * (qAt(apex.x + signX * s, apex.y) - top) / s;
    const double perRow = (qAt(apex.x, apex.y + signY * s) - top) / s;
    const int half = s / 2;
    if (!rowFits(apex.x + signX * half, apex.y + signY * half, 1, top + half * (signX * perX + perRow), 0.0))
      return false;
    for (int j = 0; j <= s; ++j) {
      const int count = s - j + 1;
      const int west = signX > 0 ? 0 : -(count - 1);
      if (!rowFits(apex.x + west, apex.y + signY * j, count, top + j * perRow + west * perX, perX))
        return false;
    }
    return true;
  }

  const StripHeights& heights_;
  int side_;
  double bound_;
  std::vector<uint8_t> isSplit_;
  std::vector<Sample> pending_;  ///< splits whose triangles are still to be looked at
};

}  // namespace

std::vector<uint8_t> splitsWithin(const StripHeights& heights, int side, double boundMeters) {
  return Refinement(heights, side, boundMeters).run();
}

}  // namespace terrane
