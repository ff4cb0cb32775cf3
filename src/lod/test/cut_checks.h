#pragma once

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <glm/vec3.hpp>
#include <random>
#include <set>
#include <vector>

#include "fake_world.h"

/// What tests of cuts share: cameras and residents at random, and what must hold of every cut.
namespace terrane {

inline Camera randomCamera(std::mt19937& random, const FakeWorld& world) {
  const double side = world.frame.spacingXMeters() * static_cast<double>(world.frame.worldCells());
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const glm::dvec3 eye(unit(random) * side, -unit(random) * side,
                       50.0 + 3000.0 * unit(random) * unit(random));
  const glm::dvec3 target(unit(random) * side, -unit(random) * side, 100.0);
  return lookAt(eye, target, 0.4 + 1.2 * unit(random), 640, 360);
}

/// Root and a random set closed under parents.
inline std::set<TileId> randomResidents(std::mt19937& random, int finestLevel, double chance) {
  std::set<TileId> out;
  for (const TileId id : FakeWorld::allTiles(finestLevel))
    if (id.isRoot() ||
        (out.count(id.parent()) && std::uniform_real_distribution<double>(0, 1)(random) < chance))
      out.insert(id);
  return out;
}

inline std::array<LatticePoint, 3> cornersOf(const Lattice& lattice, const Triangle& t) {
  const auto ends = lattice.hypotenuse(t.diamond);
  return {t.apex, ends[0], ends[1]};
}

/// Covers the whole world once and no corner of a triangle lies inside another's edge.
inline void expectConforming(const Cut& cut) {
  const Lattice lattice(cut.latticeDepth);
  double area = 0.0;
  std::set<LatticePoint> corners;
  for (const Patch& patch : cut.patches) {
    const double s = lattice.halfSize(patch.triangle.diamond.level);
    area += patch.triangle.diamond.isQuadCenter() ? 2.0 * s * s : s * s;
    for (const LatticePoint& p : cornersOf(lattice, patch.triangle)) corners.insert(p);
  }
  const double side = lattice.side();
  ASSERT_EQ(area, side * side);
  std::function<bool(LatticePoint, LatticePoint)> hasCornerInside = [&](LatticePoint a, LatticePoint b) {
    if ((a.x + b.x) % 2 != 0 || (a.y + b.y) % 2 != 0) return false;
    const LatticePoint middle{(a.x + b.x) / 2, (a.y + b.y) / 2};
    if (middle == a || middle == b) return false;
    // Corners inside an edge come with the edge's middle, since edges are only ever halved.
    return corners.count(middle) != 0;
  };
  for (const Patch& patch : cut.patches) {
    const auto c = cornersOf(lattice, patch.triangle);
    for (size_t i = 0; i < 3; ++i)
      ASSERT_FALSE(hasCornerInside(c[i], c[(i + 1) % 3]))
          << "T-junction on an edge of the patch with apex " << c[0].x << ", " << c[0].y;
  }
}

/// The set of split diamonds of a cut: those strictly above its triangles.
inline std::set<Diamond> splitDiamonds(const Cut& cut) {
  const Lattice lattice(cut.latticeDepth);
  std::set<Diamond> out;
  std::vector<Diamond> todo;
  for (const Patch& patch : cut.patches)
    if (patch.triangle.diamond.level > 0)
      todo.push_back({patch.triangle.apex.x, patch.triangle.apex.y, patch.triangle.diamond.level - 1});
  while (!todo.empty()) {
    const Diamond d = todo.back();
    todo.pop_back();
    if (!out.insert(d).second) continue;
    for (const Diamond& p : lattice.parents(d)) todo.push_back(p);
  }
  return out;
}

/// A diamond's error code from the tiles on both of its sides.
inline uint8_t errorCodeOf(const FakeWorld& world, const PatchGrid& grid, const Diamond& d) {
  const Lattice lattice(world.finestLevel);
  uint8_t code = 0;
  for (const LatticePoint& apex : lattice.apexes(d)) {
    const TileId id = lattice.tileOf({d, apex}, grid.tileLevel(d.level));
    const int shift = lattice.depth() - id.level;
    code = std::max(code, nodeErrorCode(grid, world.tiles.at(id).nodes, id.isRoot(),
                                        {(d.x >> shift) - id.col * kTileCells,
                                         (d.y >> shift) - id.row * kTileCells, d.level - 2 * id.level}));
  }
  return code;
}

}  // namespace terrane
