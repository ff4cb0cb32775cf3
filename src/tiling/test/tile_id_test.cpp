#include "terrane/tiling/tile_id.h"

#include <gtest/gtest.h>

namespace terrane {
namespace {

TEST(TileId, ChildrenKnowTheirParentAndQuadrant) {
  const TileId id{5, 17, 9};
  for (int quadrant = 0; quadrant < 4; ++quadrant) {
    const TileId child = id.child(quadrant);
    EXPECT_TRUE(child.valid());
    EXPECT_EQ(child.parent(), id);
    EXPECT_EQ(child.quadrant(), quadrant);
    EXPECT_EQ(child.ancestor(5), id);
    EXPECT_EQ(child.ancestor(0), TileId{});
  }
  EXPECT_EQ(toString(id), "5/17/9");
}

TEST(TileId, KnowsWhatIsNoAddress) {
  EXPECT_TRUE((TileId{0, 0, 0}.valid()));
  EXPECT_FALSE((TileId{0, 1, 0}.valid()));
  EXPECT_FALSE((TileId{3, 8, 0}.valid()));
  EXPECT_FALSE((TileId{3, 0, -1}.valid()));
  EXPECT_FALSE((TileId{kMaxLevel + 1, 0, 0}.valid()));
}

}  // namespace
}  // namespace terrane
