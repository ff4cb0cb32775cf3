#include "sample_plan.h"

#include <algorithm>

namespace terrane {

SamplePlan planSamples(const gpu::Limits& limits, const gpu::Workarounds& workarounds, int samples, int width,
                       int height) {
  const bool larger = workarounds.noSampleShading || workarounds.slowSampleShading;
  const int mostMultisamples = larger ? 1 : limits.maxSamples;
  const int mostShrink = std::max(1, limits.maxTextureSize / std::max(width, height));
  // Try ever larger scenes; take the fewest multi-samples that are enough in the first that can do it.
  SamplePlan plan;
  for (plan.shrink = 1; plan.shrink <= mostShrink; ++plan.shrink) {
    for (plan.multisamples = 1; plan.multisamples <= mostMultisamples; plan.multisamples *= 2)
      if (plan.samples() >= samples) return plan;
  }
  plan.shrink = mostShrink;
  plan.multisamples = 1;
  while (plan.multisamples * 2 <= mostMultisamples) plan.multisamples *= 2;
  return plan;
}

}  // namespace terrane
