#include "resident_set.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace terrane {
namespace {

TEST(ResidentSet, NeverGivesUpATileWithChildrenTheRootOrWhatIsNeeded) {
  for (uint32_t seed = 0; seed < 50; ++seed) {
    std::mt19937 random(seed);
    ResidentSet set(12);
    std::set<TileId> here;
    set.add(TileId{}, 0);
    here.insert(TileId{});
    for (uint64_t frame = 1; frame < 300; ++frame) {
      // A few are needed, with their ancestors.
      std::set<TileId> needed;
      for (int i = 0; i < 2; ++i) {
        auto at = here.begin();
        std::advance(at, static_cast<long>(random() % here.size()));
        set.need(*at, frame);
        for (TileId id = *at;; id = id.parent()) {
          needed.insert(id);
          if (id.isRoot()) break;
        }
      }
      EXPECT_EQ(set.neededSince(frame), needed.size());
      auto parent = here.begin();
      std::advance(parent, static_cast<long>(random() % here.size()));
      const TileId next = parent->child(static_cast<int>(random() % 4));
      if (here.count(next) != 0 || next.level > 6) continue;
      if (set.isFull()) {
        const auto victim = set.victim(frame);
        if (!victim) continue;
        EXPECT_EQ(needed.count(*victim), 0U);
        EXPECT_FALSE(victim->isRoot());
        for (int quadrant = 0; quadrant < 4; ++quadrant) EXPECT_EQ(here.count(victim->child(quadrant)), 0U);
        set.remove(*victim);
        here.erase(*victim);
        if (here.count(next.parent()) == 0) continue;
      }
      set.add(next, frame - 1);
      here.insert(next);
      EXPECT_LE(set.size(), set.capacity());
    }
    for (const TileId id : here) EXPECT_TRUE(set.has(id));
  }
}

}  // namespace
}  // namespace terrane
