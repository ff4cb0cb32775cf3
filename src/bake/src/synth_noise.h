#pragma once

#include <cmath>
#include <cstdint>

namespace terrane::synth {

/// Mixes a lattice point and a seed into 32 random bits.
inline uint32_t hashCell(int32_t x, int32_t y, uint32_t seed) {
  uint32_t h = seed ^ (static_cast<uint32_t>(x) * 0x9E3779B1u) ^ (static_cast<uint32_t>(y) * 0x85EBCA77u);
  h = (h ^ (h >> 16)) * 0x7FEB352Du;
  h ^= static_cast<uint32_t>(y) * 0xC2B2AE3Du;
  h = (h ^ (h >> 15)) * 0x846CA68Bu;
  return h ^ (h >> 16);
}

/// The low and the high half of `bits` as numbers in [0, 1).
inline float unitLow(uint32_t bits) {
  return static_cast<float>(bits & 0xFFFFu) * (1.0f / 65536.0f);
}
inline float unitHigh(uint32_t bits) {
  return static_cast<float>(bits >> 16) * (1.0f / 65536.0f);
}

inline float lerp(float a, float b, float t) {
  return a + (b - a) * t;
}
inline float clamp01(float t) {
  return t < 0.0f ? 0.0f : (t > 1.0f ? 1.0f : t);
}
/// 0 below `from`, 1 above `to`, smooth between.
inline float smoothStep(float from, float to, float x) {
  const float t = clamp01((x - from) / (to - from));
  return t * t * (3.0f - 2.0f * t);
}

/// The offset from lattice point (ix, iy) times that point's random gradient.
inline float gradientAt(int32_t ix, int32_t iy, uint32_t seed, float dx, float dy) {
  const uint32_t h = hashCell(ix, iy, seed);
  return (unitLow(h) * 2.0f - 1.0f) * dx + (unitHigh(h) * 2.0f - 1.0f) * dy;
}

/// Gradient noise of about [-1, 1] on the unit lattice, repeating every `period` cells (0: never).
inline float noise(double x, double y, uint32_t seed, int32_t period = 0) {
  const double floorX = std::floor(x);
  const double floorY = std::floor(y);
  const float fx = static_cast<float>(x - floorX);
  const float fy = static_cast<float>(y - floorY);
  int32_t x0 = static_cast<int32_t>(floorX);
  int32_t y0 = static_cast<int32_t>(floorY);
  int32_t x1 = x0 + 1;
  int32_t y1 = y0 + 1;
  if (period > 0) {
    const auto wrap = [period](int32_t v) { return ((v % period) + period) % period; };
    x0 = wrap(x0);
    x1 = wrap(x1);
    y0 = wrap(y0);
    y1 = wrap(y1);
  }
  const float sx = fx * fx * fx * (fx * (fx * 6.0f - 15.0f) + 10.0f);
  const float sy = fy * fy * fy * (fy * (fy * 6.0f - 15.0f) + 10.0f);
  const float north = lerp(gradientAt(x0, y0, seed, fx, fy), gradientAt(x1, y0, seed, fx - 1.0f, fy), sx);
  const float south =
      lerp(gradientAt(x0, y1, seed, fx, fy - 1.0f), gradientAt(x1, y1, seed, fx - 1.0f, fy - 1.0f), sx);
  return 1.6f * lerp(north, south, sy);
}

/// Octaves of noise, each twice as fine and half as strong; (u, v) in units of the whole period,
/// `cells` noise cells across it.
inline float periodicFbm(double u, double v, int32_t cells, int octaves, uint32_t seed) {
  float sum = 0.0f;
  float strength = 1.0f;
  for (int octave = 0; octave < octaves; ++octave) {
    sum += strength * noise(u * cells, v * cells, seed + 101u * static_cast<uint32_t>(octave), cells);
    strength *= 0.5f;
    cells *= 2;
  }
  return sum;
}

}  // namespace terrane::synth
