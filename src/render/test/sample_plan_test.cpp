#include "sample_plan.h"

#include <gtest/gtest.h>

namespace terrane {
namespace {

constexpr gpu::Limits kLimits{.maxTextureSize = 16384, .maxArrayLayers = 2048, .maxSamples = 8};

TEST(SamplePlan, TakesMultisamplesFirst) {
  for (const int samples : {1, 2, 4, 8}) {
    const SamplePlan plan = planSamples(kLimits, {}, samples, 1280, 720);
    EXPECT_EQ(plan.multisamples, samples);
    EXPECT_EQ(plan.shrink, 1);
  }
  const SamplePlan many = planSamples(kLimits, {}, 32, 1280, 720);
  EXPECT_EQ(many.samples(), 32);
  EXPECT_EQ(many.shrink, 2);
}

TEST(SamplePlan, DrawsLargerPicturesWhereSamplesAreNoUse) {
  for (const gpu::Workarounds& lacks :
       {gpu::Workarounds{.noSampleShading = true}, gpu::Workarounds{.slowSampleShading = true}}) {
    for (int samples = 1; samples <= 16; ++samples) {
      const SamplePlan plan = planSamples(kLimits, lacks, samples, 1280, 720);
      EXPECT_EQ(plan.multisamples, 1);
      EXPECT_GE(plan.samples(), samples);
      EXPECT_LT((plan.shrink - 1) * (plan.shrink - 1), samples);
    }
  }
}

TEST(SamplePlan, GivesTheBestThatFits) {
  const SamplePlan plan = planSamples(kLimits, {.noSampleShading = true}, 64, 8000, 4000);
  EXPECT_EQ(plan.shrink, 2);
  EXPECT_EQ(planSamples(kLimits, {}, 1000, 16384, 100).samples(), 8);
}

}  // namespace
}  // namespace terrane
