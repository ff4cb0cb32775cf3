#pragma once

#include <cmath>
#include <cstdint>
#include <utility>

#include "terrane/codec/elevation_codec.h"

/// The parents that the fuzzed payloads of child tiles are decoded from, and what refinements refine.
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

inline constexpr int kFuzzLayers = 3;

inline ElevationScale fuzzScaleOfLayers() {
  ElevationScale scale = kFuzzScale;
  scale.layerCount = kFuzzLayers;
  scale.layerErrors = {8.0, 2.0, 0.5};
  scale.sampleError = 0.5;
  return scale;
}

/// Any number, but always the same for a sample.
inline uint32_t fuzzNumber(int x, int y) {
  uint32_t hash = static_cast<uint32_t>(x) * 0x9e3779b1U ^ static_cast<uint32_t>(y) * 0x85ebca77U;
  hash ^= hash >> 15;
  hash *= 0x2c1b3c6dU;
  return hash ^ hash >> 12;
}

/// Puts a sample into one of the layers, or one more, which fuzzLayersOf() takes off again.
inline void fuzzLayer(size_t at, uint32_t number, TileSamples& samples) {
  samples.layers[at] = static_cast<uint8_t>(number % (kFuzzLayers + 1));
}
inline TileSamples fuzzLayersOf(TileSamples samples) {
  samples.layerCount = kFuzzLayers + 1;
  return samplesOfLayer(samples, kFuzzLayers - 1);
}

/// fuzzParent() in layers.
inline TileSamples fuzzLayeredParent() {
  TileSamples samples = fuzzParent().samples;
  samples.layers.assign(kTileSampleCount, 0);
  for (int y = 0; y < kTileSamples; ++y) {
    for (int x = 0; x < kTileSamples; ++x) {
      const auto at = static_cast<size_t>(y * kTileSamples + x);
      if (x % 16 == 0 && y % 16 == 0) samples.states[at] = SampleState::Coded;
      if (x % 8 != 0 || y % 8 != 0) fuzzLayer(at, fuzzNumber(x / 4, y / 4) + (x + y) / 64U, samples);
    }
  }
  return fuzzLayersOf(std::move(samples));
}

/// A child of it, in as many layers.
inline TileSamples fuzzLayeredChild(const TileSamples& parent, int quadrant) {
  TileSamples samples = interpolateSamples(parent, quadrant);
  for (int y = 0; y < kTileSamples; ++y) {
    for (int x = y % 2 == 0 ? 1 : 0; x < kTileSamples; x += y % 2 == 0 ? 2 : 1) {
      const auto at = static_cast<size_t>(y * kTileSamples + x);
      if (samples.states[at] == SampleState::Void) continue;
      const uint32_t number = fuzzNumber(x + 1000 * quadrant, y);
      const int64_t near = kFuzzScale.integerFromHeight(static_cast<double>(samples.heights[at]));
      samples.heights[at] = kFuzzScale.heightFromInteger(near + static_cast<int64_t>(number >> 8 & 7) - 3);
      samples.states[at] = SampleState::Coded;
      fuzzLayer(at, fuzzNumber(x / 8, y / 8 + 99 * quadrant), samples);
    }
  }
  return fuzzLayersOf(std::move(samples));
}

/// What the first byte of a fuzzed refinement says: bit 0: a child's; bits 1 and 2: of which quadrant;
/// bit 3: the second of the layers after the first, not the first of them.
struct FuzzPlace {
  explicit FuzzPlace(uint8_t byte)
      : isChild((byte & 1) != 0), quadrant(isChild ? byte >> 1 & 3 : 0), layer(1 + (byte >> 3 & 1)) {}
  bool isChild;
  int quadrant;
  int layer;
};

}  // namespace terrane
