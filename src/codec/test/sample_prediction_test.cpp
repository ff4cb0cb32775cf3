#include "sample_prediction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace terrane {
namespace {

TEST(SamplePrediction, SpreadsOfARowAreThoseOfItsSamples) {
  std::mt19937 random(7);
  for (int count = 1; count <= 129; ++count) {
    SpreadShifts shifts;
    for (int8_t& shift : shifts) shift = static_cast<int8_t>(static_cast<int>(random() % 129) - 64);
    std::array<uint8_t, RowPrediction::kRoom> contexts{};
    for (uint8_t& context : contexts) context = static_cast<uint8_t>(random() % kSizeContexts);
    std::array<uint8_t, RowPrediction::kRoom> spreads{};
    spreadsOf(contexts.data(), count, shifts, spreads.data());
    for (size_t x = 0; x < static_cast<size_t>(count); ++x) {
      ASSERT_EQ(spreads[x], spreadOf(contexts[x], shifts)) << count << ", " << x;
      ASSERT_LT(spreads[x], kSpreads);
    }
  }
}

TEST(SamplePrediction, StepsAreTheNearest) {
  std::mt19937 random(11);
  const ElevationScale scale{.heightStep = 0.3, .heightOffset = -37.5};
  std::vector<float> heights(129 * 4);
  for (float& height : heights)
    height = scale.heightFromInteger(static_cast<int64_t>(random() % 200001) - 100000);
  for (const int stride : {1, 2, 4}) {
    std::array<int32_t, RowPrediction::kRoom> steps{};
    stepsOf(heights.data(), stride, 129, scale, steps.data());
    for (size_t x = 0; x < 129; ++x) {
      const auto height = static_cast<double>(heights[x * static_cast<size_t>(stride)]);
      ASSERT_EQ(steps[x], scale.integerFromHeight(height)) << stride << ", " << x;
    }
  }
  // Whatever is far away stays at the limits.
  const std::vector<float> far = {3e38F, -3e38F, std::numeric_limits<float>::max(), 0.0F};
  std::array<int32_t, RowPrediction::kRoom> steps{};
  stepsOf(far.data(), 1, 4, scale, steps.data());
  EXPECT_EQ(steps[0], 1 << 25);
  EXPECT_EQ(steps[1], -(1 << 25));
  EXPECT_EQ(steps[3], 125);
}

}  // namespace
}  // namespace terrane
