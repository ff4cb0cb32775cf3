#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "terrane/codec/tile.h"

namespace terrane {
namespace {

TEST(ElevationScale, ErrorCodesAscendByEighthsOfAnOctave) {
  const ElevationScale scale{.errorUnit = 0.01};
  EXPECT_EQ(scale.errorFromCode(0), 0.0);
  EXPECT_EQ(scale.errorFromCode(1), 0.01);
  for (int code = 2; code <= 255; ++code) {
    const double ratio =
        scale.errorFromCode(static_cast<uint8_t>(code)) / scale.errorFromCode(static_cast<uint8_t>(code - 1));
    EXPECT_NEAR(ratio, std::exp2(0.125), 1e-12) << code;
    EXPECT_EQ(scale.codeFromError(scale.errorFromCode(static_cast<uint8_t>(code))), code);
  }
  EXPECT_EQ(scale.errorFromCode(9), 2 * scale.errorFromCode(1));
}

TEST(ElevationScale, ErrorCodeClaimsAtLeastTheErrorAndIsTheSmallest) {
  const ElevationScale scale{.errorUnit = 0.003};
  std::mt19937 random(1);
  std::uniform_real_distribution<double> exponent(-12.0, 8.0);
  for (int i = 0; i < 20000; ++i) {
    const double error = std::exp2(exponent(random) * 2.0);
    const uint8_t code = scale.codeFromError(error);
    if (code < 255) {
      ASSERT_GE(scale.errorFromCode(code), error);
    }
    if (code > 0) {
      ASSERT_LT(scale.errorFromCode(static_cast<uint8_t>(code - 1)), error);
    }
  }
  EXPECT_EQ(scale.codeFromError(0.0), 0);
  EXPECT_EQ(scale.codeFromError(-1.0), 0);
  EXPECT_EQ(scale.codeFromError(1e-300), 1);
  EXPECT_EQ(scale.codeFromError(std::numeric_limits<double>::infinity()), 255);
  EXPECT_EQ(scale.codeFromError(std::numeric_limits<double>::quiet_NaN()), 255);
}

TEST(ElevationScale, RangeCodesEncloseTheHeightTightly) {
  std::mt19937 random(2);
  for (const double unit : {1.0, 0.1, 0.0375, 1.0 / 3.0}) {
    const ElevationScale scale{.rangeBase = -431.7, .rangeUnit = unit};
    std::uniform_real_distribution<double> heights(-431.7, -431.7 + 65535.0 * unit);
    for (int i = 0; i < 20000; ++i) {
      // Both anywhere and exactly on a code.
      const uint16_t some = static_cast<uint16_t>(random() % 65536);
      const double height = i % 2 == 0 ? heights(random) : scale.heightFromRangeCode(some);
      const uint16_t low = scale.lowCode(height);
      const uint16_t high = scale.highCode(height);
      ASSERT_LE(scale.heightFromRangeCode(low), height);
      ASSERT_GE(scale.heightFromRangeCode(high), height);
      ASSERT_LE(high - low, 1);
      if (i % 2 != 0) {
        ASSERT_TRUE(low == some && high == some);
      }
    }
    EXPECT_EQ(scale.lowCode(-1e9), 0);
    EXPECT_EQ(scale.highCode(-1e9), 0);
    EXPECT_EQ(scale.lowCode(1e9), 65535);
    EXPECT_EQ(scale.highCode(1e9), 65535);
  }
}

TEST(ElevationScale, StepNumbersAndHeightsAreInverse) {
  std::mt19937 random(3);
  for (const double step : {1.0, 0.01, 0.15, 1.0 / 3.0, 0.3048}) {
    const ElevationScale scale{.heightStep = step, .heightOffset = 12.25};
    for (int i = 0; i < 20000; ++i) {
      const int64_t q = static_cast<int64_t>(random() % 2000001) - 1000000;
      ASSERT_EQ(scale.integerFromHeight(static_cast<double>(scale.heightFromInteger(q))), q) << step;
    }
  }
  const ElevationScale meters{};
  EXPECT_EQ(meters.integerFromHeight(0.5), 1);
  EXPECT_EQ(meters.integerFromHeight(-0.5), -1);
  EXPECT_EQ(meters.integerFromHeight(0.49), 0);
}

}  // namespace
}  // namespace terrane
