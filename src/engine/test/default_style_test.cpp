#include "terrane/engine/default_style.h"

#include <gtest/gtest.h>

namespace terrane {
namespace {

Manifest between(double low, double high, std::optional<double> zeroShare) {
  Manifest out;
  out.minHeight = low;
  out.maxHeight = high;
  out.maxErrorMeters = 0.4;
  out.zeroShare = zeroShare;
  return out;
}

TEST(DefaultStyle, TheSeaIsWhereMuchGroundIsLevelAtZero) {
  const RenderStyle coast = defaultStyle(between(-85.0, 4400.0, 0.12));
  EXPECT_EQ(coast.waterLevelMeters, 0.0);
  // A valley below the sea's level is dry.
  ASSERT_TRUE(coast.waterWithinMeters);
  EXPECT_EQ(*coast.waterWithinMeters, 0.4);
  EXPECT_FALSE(defaultStyle(between(-85.0, 3300.0, 0.0)).waterLevelMeters);
  EXPECT_FALSE(defaultStyle(between(-6.0, 300.0, 0.001)).waterLevelMeters);
  EXPECT_FALSE(defaultStyle(between(12.0, 300.0, 0.0)).waterLevelMeters);
}

TEST(DefaultStyle, OlderDatasetsTellByTheirLowestGround) {
  EXPECT_EQ(defaultStyle(between(-8.0, 2300.0, {})).waterLevelMeters, 0.0);
  EXPECT_FALSE(defaultStyle(between(-8.0, 2300.0, {})).waterWithinMeters);
  EXPECT_FALSE(defaultStyle(between(3.0, 2300.0, {})).waterLevelMeters);
}

}  // namespace
}  // namespace terrane
