#include "terrane/engine/line_of_sight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace terrane {
namespace {

TEST(LineOfSight, AWallHidesAndAGapDoesNot) {
  // 1000 m of flat ground with a roof of 10 m in the middle.
  const std::vector<SurfacePiece> roof = {{0.0, 0.4, true, 100.0, 100.0},
                                          {0.4, 0.5, true, 100.0, 110.0},
                                          {0.5, 0.6, true, 110.0, 100.0},
                                          {0.6, 1.0, true, 100.0, 100.0}};
  SightResult seen = lookAlong(roof, {102.0, 102.0, 1000.0, 0.0});
  EXPECT_FALSE(seen.visible);
  EXPECT_NEAR(*seen.clearanceMeters, -8.0, 1e-9);
  EXPECT_NEAR(*seen.blockedAt, 0.42, 1e-9);
  EXPECT_NEAR(seen.blockedHeight, 102.0, 1e-9);
  seen = lookAlong(roof, {112.0, 112.0, 1000.0, 0.0});
  EXPECT_TRUE(seen.visible);
  EXPECT_NEAR(*seen.clearanceMeters, 2.0, 1e-9);
  EXPECT_FALSE(seen.blockedAt);
  // Level with the top is still seen; void hides nothing.
  EXPECT_TRUE(lookAlong(roof, {110.0, 110.0, 1000.0, 0.0}).visible);
  const std::vector<SurfacePiece> gap = {
      {0.0, 0.4, true, 100.0, 100.0}, {0.4, 0.6, false, 900.0, 900.0}, {0.6, 1.0, true, 100.0, 100.0}};
  EXPECT_TRUE(lookAlong(gap, {102.0, 102.0, 1000.0, 0.0}).visible);
  EXPECT_FALSE(lookAlong(std::vector<SurfacePiece>{{0.0, 1.0, false, 0.0, 0.0}}, {1.0, 1.0, 10.0, 0.0})
                   .clearanceMeters);
}

TEST(LineOfSight, TheSeaRisesBetweenShips) {
  // Over d metres the earth bulges by d^2 / 8R: 25.7 km hide 13 m, in the middle of one long piece.
  constexpr double kRadius = 6371008.8;
  const double length = 25743.0;
  const std::vector<SurfacePiece> sea = {{0.0, 1.0, true, 0.0, 0.0}};
  const double bulge = length * length / (8.0 * kRadius);
  EXPECT_FALSE(lookAlong(sea, {bulge - 0.01, bulge - 0.01, length, kRadius}).visible);
  const SightResult seen = lookAlong(sea, {bulge + 0.01, bulge + 0.01, length, kRadius});
  EXPECT_TRUE(seen.visible);
  EXPECT_NEAR(*seen.clearanceMeters, 0.01, 1e-6);
  EXPECT_TRUE(lookAlong(sea, {1.0, 1.0, length, 0.0}).visible);
  EXPECT_NEAR(sightRadiusMeters(0.0, {}), kRadius, 0.1);
  EXPECT_NEAR(sightRadiusMeters(0.13, {}), 7322998.6, 0.1);
  EXPECT_EQ(sightRadiusMeters(0.0, {1737400.0, 0.0}), 1737400.0);
}

TEST(LineOfSight, AgreesWithVeryManySteps) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> height(0.0, 30.0);
  int hidden = 0;
  for (int round = 0; round < 400; ++round) {
    std::vector<SurfacePiece> pieces;
    double before = height(random);
    const int count = 1 + round % 9;
    for (int i = 0; i < count; ++i) {
      const double next = height(random);
      pieces.push_back({double(i) / count, double(i + 1) / count, true, before, next});
      before = next;
    }
    const SightLine line{pieces.front().beginHeight + height(random), before + height(random), 20000.0,
                         round % 2 == 0 ? 0.0 : 6371008.8};
    const SightResult result = lookAlong(pieces, line);
    double clearance = 1e9, first = 2.0;
    constexpr int kSteps = 20000;
    for (int k = 0; k <= kSteps; ++k) {
      const double t = double(k) / kSteps;
      const SurfacePiece& piece = pieces[std::min<size_t>(static_cast<size_t>(t * count), pieces.size() - 1)];
      const double ground = piece.beginHeight + (t - piece.begin) / (piece.end - piece.begin) *
                                                    (piece.endHeight - piece.beginHeight);
      const double bulge = line.radiusMeters > 0.0 ? t * (1.0 - t) * 4e8 / (2.0 * line.radiusMeters) : 0.0;
      const double above = line.fromHeight + t * (line.toHeight - line.fromHeight) - ground - bulge;
      clearance = std::min(clearance, above);
      if (above < -1e-6) first = std::min(first, t);
    }
    ASSERT_NEAR(*result.clearanceMeters, clearance, 0.05);
    if (std::abs(clearance) < 0.05) continue;
    ASSERT_EQ(result.visible, clearance > 0.0);
    if (!result.visible) {
      ASSERT_NEAR(*result.blockedAt, first, 2.0 / kSteps);
    }
    hidden += result.visible ? 0 : 1;
  }
  EXPECT_GT(hidden, 50);
  EXPECT_LT(hidden, 350);
}

}  // namespace
}  // namespace terrane
