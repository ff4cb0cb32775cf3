#pragma once

#include <glm/vec2.hpp>
#include <vector>

#include "terrane/tiling/lattice.h"

namespace terrane {

/// An octagon around a diamond's centre, in cells: |x| <= extent, |y| <= extent, |x| + |y| <= sum (Gerstner
/// 2003). Its corners are (+-extent, +-inner()) and (+-inner(), +-extent).
struct Octagon {
  double extent = 0.0;
  double sum = 0.0;
  double inner() const { return sum - extent; }

  /// Largest value of n.x * x + n.y * y over the octagon.
  double support(glm::dvec2 n) const;
  /// Distance from `offset` (relative to the centre) to the octagon; 0 inside.
  double distance(glm::dvec2 offset) const;
};

/// The octagons that hold a diamond's triangles and all their descendants down to a deepest bintree level,
/// for every level at once. A child's octagon lies inside each parent's: whatever grows with the octagon
/// (nearness, visibility) is saturated by construction.
class NestedOctagons {
 public:
  /// `deepestLevel`: the deepest bintree level that may be drawn.
  NestedOctagons(const Lattice& lattice, int deepestLevel);
  /// Over the diamond and all its descendants.
  const Octagon& nested(int level) const { return nested_[static_cast<size_t>(level)]; }
  /// Over the diamond's own two triangles.
  const Octagon& own(int level) const { return own_[static_cast<size_t>(level)]; }

 private:
  std::vector<Octagon> nested_;
  std::vector<Octagon> own_;
};

}  // namespace terrane
