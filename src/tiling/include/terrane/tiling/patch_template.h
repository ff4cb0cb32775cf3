#pragma once

#include <cstdint>
#include <vector>

#include "terrane/tiling/lattice.h"

namespace terrane {

/// The vertices and triangles of a K-patch in template coordinates (see PatchPlacement): K(K + 1) / 2
/// vertices, (K - 1)^2 triangles, K vertices on each side. Every triangle turns from x towards y (clockwise
/// on the map); triangles follow each other along the bisection, so that a small vertex cache serves them.
struct PatchTemplate {
  std::vector<LatticePoint> vertices;
  std::vector<uint16_t> indices;
};

/// The right-angle template, for patches of even bintree levels.
PatchTemplate makeRightAngleTemplate(const PatchGrid& grid);
/// The hypotenuse template, for patches of odd bintree levels.
PatchTemplate makeHypotenuseTemplate(const PatchGrid& grid);

}  // namespace terrane
