#include "buddy_allocator.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace terrane {
namespace {

TEST(BuddyAllocator, BlocksNeverOverlapAndJoinAgain) {
  std::mt19937 random(1);
  for (int run = 0; run < 20; ++run) {
    BuddyAllocator places(1024, 4);
    std::map<uint32_t, uint32_t> taken;  // first unit, units asked for
    for (int step = 0; step < 3000; ++step) {
      if (random() % 3 != 0 || taken.empty()) {
        const auto units = static_cast<uint32_t>(1 + random() % (random() % 8 == 0 ? 300 : 30));
        const auto first = places.take(units);
        if (!first) {
          if (random() % 50 == 0 && places.units() < 8192) places.grow();
          continue;
        }
        ASSERT_LE(*first + units, places.units());
        const auto next = taken.lower_bound(*first);
        if (next != taken.end()) {
          ASSERT_LE(*first + units, next->first);
        }
        if (next != taken.begin()) {
          ASSERT_LE(std::prev(next)->first + std::prev(next)->second, *first);
        }
        taken[*first] = units;
      } else {
        auto at = taken.begin();
        std::advance(at, static_cast<ptrdiff_t>(random() % taken.size()));
        places.giveBack(at->first);
        taken.erase(at);
      }
    }
    for (const auto& [first, units] : taken) places.giveBack(first);
    EXPECT_EQ(places.usedUnits(), 0U);
    EXPECT_EQ(places.take(places.units()), 0U);  // all of it is one block again
  }
}

TEST(BuddyAllocator, GrowsWhetherFullOrEmpty) {
  BuddyAllocator places(16, 16);
  places.grow();
  EXPECT_EQ(places.take(32), 0U);
  places.grow();
  EXPECT_EQ(places.take(32), 32U);
  EXPECT_FALSE(places.take(1));
  places.giveBack(0);
  EXPECT_EQ(places.take(17), 0U);
}

}  // namespace
}  // namespace terrane
