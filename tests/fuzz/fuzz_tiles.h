#pragma once

#include <cmath>

#include "terrane/codec/elevation_codec.h"

/// The parent that the fuzzed payloads of child tiles are decoded from.
namespace terrane {

inline constexpr ElevationScale kFuzzScale{
    .heightStep = 0.25, .heightOffset = -11.0, .errorUnit = 0.01, .rangeBase = -500.0, .rangeUnit = 0.1};

/// A hilly root tile with samples of every state: void in the north-west, interpolated in the south-east.
inline Tile fuzzParent() {
  Tile tile;
  TileSamples& samples = tile.samples;
  samples.heights.resize(kTileSampleCount);
  samples.states.resize(kTileSampleCount);
  for (int y = 0; y < kTileSamples; ++y) {
    for (int x = 0; x < kTileSamples; ++x) {
      const auto at = static_cast<size_t>(y) * kTileSamples + static_cast<size_t>(x);
      const double hills = 300.0 + 4.0 * ((x * 7 + y * 3) % 64) + 0.01 * x * y;
      samples.heights[at] = kFuzzScale.heightFromInteger(kFuzzScale.integerFromHeight(hills));
      samples.states[at] = x + y < 100   ? SampleState::Void
                           : x + y > 400 ? SampleState::Interpolated
                                         : SampleState::Coded;
    }
  }
  samples.coverage.kind = Coverage::Kind::Partial;
  samples.coverage.bits.assign(Coverage::kBytes, 0xf0);
  return tile;
}

}  // namespace terrane
