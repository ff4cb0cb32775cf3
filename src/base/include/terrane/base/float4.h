#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace terrane {

/// Four floats at once; every operation is the plain IEEE one in each lane, so that results do not depend on
/// the machine.
#if defined(__SSE2__)
struct Float4 {
  __m128 v;
  static Float4 load(const float* from) { return {_mm_loadu_ps(from)}; }
  static Float4 all(float value) { return {_mm_set1_ps(value)}; }
  void store(float* to) const { _mm_storeu_ps(to, v); }
  friend Float4 operator+(Float4 a, Float4 b) { return {_mm_add_ps(a.v, b.v)}; }
  friend Float4 operator-(Float4 a, Float4 b) { return {_mm_sub_ps(a.v, b.v)}; }
  friend Float4 operator*(Float4 a, Float4 b) { return {_mm_mul_ps(a.v, b.v)}; }
};
inline Float4 absolute(Float4 a) {
  return {_mm_and_ps(a.v, _mm_castsi128_ps(_mm_set1_epi32(0x7fffffff)))};
}
/// The larger of `best` and `value`; a NaN in `value` does not count.
inline Float4 larger(Float4 value, Float4 best) {
  return {_mm_max_ps(value.v, best.v)};
}
/// A bit for each lane where `a` is above `b`, the first lane's lowest.
inline uint32_t lanesAbove(Float4 a, Float4 b) {
  return static_cast<uint32_t>(_mm_movemask_ps(_mm_cmpgt_ps(a.v, b.v)));
}
/// The lanes of `a` where the mask's bits are all set, of `b` where none is.
inline Float4 choose(const uint32_t* mask, Float4 a, Float4 b) {
  const __m128 m = _mm_loadu_ps(reinterpret_cast<const float*>(mask));
  return {_mm_or_ps(_mm_and_ps(m, a.v), _mm_andnot_ps(m, b.v))};
}
/// a0 b0 a1 b1 a2 b2 a3 b3.
inline void storeInterleaved(Float4 a, Float4 b, float* to) {
  _mm_storeu_ps(to, _mm_unpacklo_ps(a.v, b.v));
  _mm_storeu_ps(to + 4, _mm_unpackhi_ps(a.v, b.v));
}
#else
struct Float4 {
  float v[4];
  static Float4 load(const float* from) {
    Float4 out;
    std::memcpy(out.v, from, sizeof(out.v));
    return out;
  }
  static Float4 all(float value) { return {{value, value, value, value}}; }
  void store(float* to) const { std::memcpy(to, v, sizeof(v)); }
  template <class F>
  static Float4 zip(Float4 a, Float4 b, F f) {
    return {{f(a.v[0], b.v[0]), f(a.v[1], b.v[1]), f(a.v[2], b.v[2]), f(a.v[3], b.v[3])}};
  }
  friend Float4 operator+(Float4 a, Float4 b) {
    return zip(a, b, [](float x, float y) { return x + y; });
  }
  friend Float4 operator-(Float4 a, Float4 b) {
    return zip(a, b, [](float x, float y) { return x - y; });
  }
  friend Float4 operator*(Float4 a, Float4 b) {
    return zip(a, b, [](float x, float y) { return x * y; });
  }
};
inline Float4 absolute(Float4 a) {
  return Float4::zip(a, a, [](float x, float) { return x < 0.0F ? -x : x; });
}
inline Float4 larger(Float4 value, Float4 best) {
  return Float4::zip(value, best, [](float x, float y) { return x > y ? x : y; });
}
inline uint32_t lanesAbove(Float4 a, Float4 b) {
  uint32_t out = 0;
  for (int i = 0; i < 4; ++i) out |= static_cast<uint32_t>(a.v[i] > b.v[i] ? 1 : 0) << i;
  return out;
}
inline Float4 choose(const uint32_t* mask, Float4 a, Float4 b) {
  Float4 out;
  for (int i = 0; i < 4; ++i) out.v[i] = mask[i] != 0 ? a.v[i] : b.v[i];
  return out;
}
inline void storeInterleaved(Float4 a, Float4 b, float* to) {
  for (int i = 0; i < 4; ++i) {
    to[2 * i] = a.v[i];
    to[2 * i + 1] = b.v[i];
  }
}
#endif

}  // namespace terrane
