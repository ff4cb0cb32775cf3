#include "terrane/tiling/lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "terrane/tiling/patch_template.h"

namespace terrane {
namespace {

/// A bintree triangle by its corners, bisected without any of the lattice's rules: the reference.
struct Corners {
  LatticePoint apex, left, right;
  LatticePoint middle() const { return {(left.x + right.x) / 2, (left.y + right.y) / 2}; }
};

std::vector<Corners> bisectAll(const std::vector<Corners>& level) {
  std::vector<Corners> out;
  for (const Corners& t : level) {
    out.push_back({t.middle(), t.apex, t.left});
    out.push_back({t.middle(), t.right, t.apex});
  }
  return out;
}

std::vector<Corners> rootCorners(int32_t side) {
  return {{{side, 0}, {side, side}, {0, 0}}, {{0, side}, {0, 0}, {side, side}}};
}

using PointPair = std::pair<LatticePoint, LatticePoint>;
PointPair sorted(LatticePoint a, LatticePoint b) {
  return a < b ? PointPair{a, b} : PointPair{b, a};
}

/// World of 4 cells (a fraction of a tile) is enough to see every kind of diamond; the arithmetic does not
/// know tiles, so the brute force runs on the coarse end of depth 0 down to single cells.
TEST(Lattice, AgreesWithBisectionOfTriangles) {
  const Lattice lattice(0);
  std::vector<Corners> level = rootCorners(lattice.side());
  std::map<LatticePoint, int> levelOf;
  for (int n = 0; n <= lattice.deepestLevel(); ++n) {
    std::map<LatticePoint, std::set<LatticePoint>> apexesOf;
    std::map<LatticePoint, PointPair> hypotenuseOf;
    for (const Corners& t : level) {
      apexesOf[t.middle()].insert(t.apex);
      const PointPair ends = sorted(t.left, t.right);
      const auto [at, isNew] = hypotenuseOf.try_emplace(t.middle(), ends);
      EXPECT_EQ(at->second, ends) << "two triangles share a middle but no hypotenuse";
    }
    for (const auto& [center, apexes] : apexesOf) {
      ASSERT_TRUE(levelOf.emplace(center, n).second) << "a sample is a diamond twice";
      const Diamond d = lattice.diamondAt(center);
      ASSERT_EQ(d.level, n);
      const auto ends = lattice.hypotenuse(d);
      EXPECT_EQ(sorted(ends[0], ends[1]), hypotenuseOf[center]);
      const auto found = lattice.apexes(d);
      EXPECT_EQ(std::set<LatticePoint>(found.begin(), found.end()), apexes);
    }
    level = bisectAll(level);
    if (n == lattice.deepestLevel()) break;
  }
  // Every sample but the corners is exactly one diamond.
  EXPECT_EQ(levelOf.size(), static_cast<size_t>(kTileSampleCount - 4));
}

TEST(Lattice, ParentsAndChildrenAreInverse) {
  const Lattice lattice(0);
  for (int32_t y = 0; y <= lattice.side(); ++y) {
    for (int32_t x = 0; x <= lattice.side(); ++x) {
      if ((x == 0 || x == lattice.side()) && (y == 0 || y == lattice.side())) continue;
      const Diamond d = lattice.diamondAt({x, y});
      const auto parents = lattice.parents(d);
      const bool onBorder = x == 0 || y == 0 || x == lattice.side() || y == lattice.side();
      EXPECT_EQ(parents.count, d.level == 0 ? 0 : onBorder ? 1 : 2);
      for (const Diamond& p : parents) {
        EXPECT_EQ(lattice.diamondAt(p.center()), p);
        const auto siblings = lattice.children(p);
        EXPECT_EQ(std::count(siblings.begin(), siblings.end(), d), 1);
      }
      if (d.level == lattice.deepestLevel()) continue;
      const auto children = lattice.children(d);
      EXPECT_EQ(children.count, onBorder ? 2 : 4);
      for (const Diamond& c : children) {
        const auto back = lattice.parents(c);
        EXPECT_EQ(std::count(back.begin(), back.end(), d), 1);
      }
    }
  }
}

TEST(Lattice, CoordinatesScaleWithDepth) {
  // A point keeps its level, its parents and its hypotenuse when the unit is halved.
  const Lattice coarse(0), fine(3);
  for (const LatticePoint p : {LatticePoint{128, 128}, {3, 7}, {0, 64}, {96, 32}, {255, 1}}) {
    const Diamond a = coarse.diamondAt(p);
    const Diamond b = fine.diamondAt({p.x * 8, p.y * 8});
    EXPECT_EQ(a.level, b.level);
    for (size_t end = 0; end < 2; ++end) {
      EXPECT_EQ(coarse.hypotenuse(a)[end].x * 8, fine.hypotenuse(b)[end].x);
      EXPECT_EQ(coarse.hypotenuse(a)[end].y * 8, fine.hypotenuse(b)[end].y);
    }
  }
}

/// All triangles of a bintree level, by splitting every diamond.
std::vector<Triangle> trianglesAt(const Lattice& lattice, int level) {
  const auto roots = lattice.rootTriangles();
  std::vector<Triangle> out(roots.begin(), roots.end());
  for (int n = 0; n < level; ++n) {
    std::set<Diamond> diamonds;
    for (const Triangle& t : out) diamonds.insert(t.diamond);
    out.clear();
    for (const Diamond& d : diamonds)
      for (const Triangle& t : lattice.trianglesAfterSplit(d)) out.push_back(t);
  }
  return out;
}

TEST(Lattice, SplittingEveryDiamondCoversTheWorldOnce) {
  const Lattice lattice(0);
  for (int level = 0; level <= 9; ++level) EXPECT_EQ(trianglesAt(lattice, level).size(), size_t{2} << level);
}

TEST(PatchTemplate, HasTheRightNumberOfVerticesEverywhere) {
  for (int k = 0; k <= PatchGrid::kLargest; ++k) {
    const PatchGrid grid{k};
    const int cells = grid.cellsPerSide();
    for (const bool rightAngle : {true, false}) {
      const PatchTemplate made = rightAngle ? makeRightAngleTemplate(grid) : makeHypotenuseTemplate(grid);
      EXPECT_EQ(made.vertices.size(), static_cast<size_t>((cells + 1) * (cells + 2) / 2));
      EXPECT_EQ(made.indices.size(), static_cast<size_t>(3 * cells * cells));
      for (size_t i = 0; i < made.indices.size(); i += 3) {
        const LatticePoint a = made.vertices[made.indices[i]], b = made.vertices[made.indices[i + 1]],
                           c = made.vertices[made.indices[i + 2]];
        const int32_t area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        EXPECT_EQ(area, rightAngle ? 1 : 2) << "winding or size";
      }
    }
  }
}

/// The patches of one bintree level, placed, are the triangles 2k levels deeper: whatever template,
/// rotation and tile.
TEST(PatchPlacement, PlacesEveryPatchOnTheFullyBisectedMesh) {
  const Lattice lattice(1);
  for (int k = 1; k <= 3; ++k) {
    const PatchGrid grid{k};
    const PatchTemplate templates[2] = {makeRightAngleTemplate(grid), makeHypotenuseTemplate(grid)};
    for (int level = 0; level <= 7; ++level) {
      std::multiset<std::array<LatticePoint, 3>> drawn, expected;
      for (const Triangle& t : trianglesAt(lattice, level)) {
        const PatchPlacement place = placePatch(lattice, grid, t);
        const PatchTemplate& made = templates[level % 2];
        for (size_t i = 0; i < made.indices.size(); i += 3) {
          std::array<LatticePoint, 3> corners;
          for (size_t c = 0; c < 3; ++c) {
            const LatticePoint v = made.vertices[made.indices[i + c]];
            const LatticePoint r = rotateQuarters(v, place.rotation);
            corners[c] = {place.origin.x + place.unit * r.x, place.origin.y + place.unit * r.y};
          }
          std::sort(corners.begin(), corners.end());
          drawn.insert(corners);
        }
      }
      std::vector<Corners> reference = rootCorners(lattice.side());
      for (int n = 0; n < level + 2 * k; ++n) reference = bisectAll(reference);
      for (const Corners& t : reference) {
        std::array<LatticePoint, 3> corners = {t.apex, t.left, t.right};
        std::sort(corners.begin(), corners.end());
        expected.insert(corners);
      }
      EXPECT_EQ(drawn, expected) << "k " << k << " level " << level;
    }
  }
}

TEST(PatchGrid, EveryPatchFindsItsVerticesInItsTileAndNotInTheParent) {
  const Lattice lattice(2);
  for (int k = 2; k <= PatchGrid::kLargest; ++k) {
    const PatchGrid grid{k};
    for (int level = 0; level <= std::min(11, grid.deepestLevel(2)); ++level) {
      const int tileLevel = grid.tileLevel(level);
      for (const Triangle& t : trianglesAt(lattice, level)) {
        const PatchPlacement place = placePatch(lattice, grid, t);
        const TileId tile = lattice.tileOf(t, tileLevel);
        const int32_t spacing = 1 << (lattice.depth() - tileLevel);
        const PatchTemplate made =
            level % 2 == 0 ? makeRightAngleTemplate(grid) : makeHypotenuseTemplate(grid);
        bool parentWouldDo = true;
        for (const LatticePoint v : made.vertices) {
          const LatticePoint r = rotateQuarters(v, place.rotation);
          const int32_t x = place.origin.x + place.unit * r.x, y = place.origin.y + place.unit * r.y;
          ASSERT_EQ(x % spacing, 0);
          ASSERT_EQ(y % spacing, 0);
          const int32_t texelX = x / spacing - tile.col * kTileCells,
                        texelY = y / spacing - tile.row * kTileCells;
          ASSERT_TRUE(texelX >= 0 && texelX <= kTileCells && texelY >= 0 && texelY <= kTileCells);
          parentWouldDo &= texelX % 2 == 0 && texelY % 2 == 0;
        }
        EXPECT_EQ(parentWouldDo, tileLevel == 0 && level < grid.rootLevels() - 1);
      }
    }
  }
}

}  // namespace
}  // namespace terrane
