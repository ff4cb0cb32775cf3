#pragma once

#include "terrane/gpu/context.h"

namespace terrane {

/// How to get a number of samples a pixel: the GPU's own multi-sampling (with the shader run for each sample)
/// times a larger picture that is shrunk at the end.
struct SamplePlan {
  int multisamples = 1;
  int shrink = 1;  ///< scene pixels along a picture pixel's side
  int samples() const { return multisamples * shrink * shrink; }
};

/// The cheapest plan with at least `samples` samples a pixel, or the best one whose scene still fits into the
/// driver's largest picture.
SamplePlan planSamples(const gpu::Limits& limits, const gpu::Workarounds& workarounds, int samples, int width,
                       int height);

}  // namespace terrane
