#include "terrane/tiling/node_layout.h"

#include <gtest/gtest.h>

#include <set>

namespace terrane {
namespace {

TEST(NodeLayout, CountsAsTheFormatSays) {
  EXPECT_EQ(tileNodeCount(false), 400);
  EXPECT_EQ(tileNodeCount(true), 541);
  EXPECT_EQ(tileLargeNodeCount(false), 140);
  EXPECT_EQ(tileLargeNodeCount(true), 187);
}

TEST(NodeLayout, IndexAndPlaceAreInverseAndMatchTheLattice) {
  for (const bool isRoot : {false, true}) {
    for (int index = 0; index < tileNodeCount(isRoot); ++index) {
      const NodePlace place = nodePlace(index, isRoot);
      EXPECT_EQ(nodeIndex(place.nodeLevel, place.x, place.y, isRoot), index);
      const Diamond d = Lattice(0).diamondAt({place.x, place.y});
      EXPECT_EQ(d.level, place.nodeLevel);
    }
  }
}

TEST(NodeLayout, LargerPatchesHaveEachTheirPlace) {
  for (const bool isRoot : {false, true}) {
    std::set<int> seen;
    for (int k = 5; k <= 7; ++k)
      for (int level = firstLargeNodeLevel(k, isRoot); level <= lastLargeNodeLevel(k); ++level)
        for (int y = 0; y <= kTileCells; y += nodeHalfSize(level))
          for (int x = 0; x <= kTileCells; x += nodeHalfSize(level))
            if ((x % kTileCells || y % kTileCells) && Lattice(0).diamondAt({x, y}).level == level) {
              EXPECT_TRUE(seen.insert(largeNodeIndex(k, level, x, y, isRoot)).second);
            }
    EXPECT_EQ(static_cast<int>(seen.size()), tileLargeNodeCount(isRoot));
    EXPECT_EQ(*seen.rbegin(), tileLargeNodeCount(isRoot) - 1);
  }
}

TEST(NodeLayout, HoldsExactlyTheDiamondsOfTheTilesOwnPatches) {
  // For every triangle whose patch lies in a tile: the tile carries the triangle's diamond.
  const Lattice lattice(2);
  std::set<std::pair<TileId, int>> expected;
  UpToFour<Triangle> roots = lattice.rootTriangles();
  std::vector<Triangle> level(roots.begin(), roots.end());
  for (int n = 0; n <= kNodeGrid.deepestLevel(2); ++n) {
    std::set<Diamond> diamonds;
    for (const Triangle& t : level) {
      const TileId tile = lattice.tileOf(t, kNodeGrid.tileLevel(n));
      const int shift = lattice.depth() - tile.level;
      const int x = (t.diamond.x >> shift) - tile.col * kTileCells;
      const int y = (t.diamond.y >> shift) - tile.row * kTileCells;
      const int nodeLevel = n - 2 * tile.level;
      ASSERT_GE(nodeLevel, firstNodeLevel(tile.isRoot()));
      ASSERT_LT(nodeLevel, kNodeLevels);
      expected.insert({tile, nodeIndex(nodeLevel, x, y, tile.isRoot())});
      diamonds.insert(t.diamond);
    }
    std::vector<Triangle> next;
    for (const Diamond& d : diamonds)
      for (const Triangle& t : lattice.trianglesAfterSplit(d)) next.push_back(t);
    level = next;
  }
  EXPECT_EQ(expected.size(), 541u + 20u * 400u);
}

}  // namespace
}  // namespace terrane
