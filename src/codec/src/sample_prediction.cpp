#include "sample_prediction.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "always_inline.h"
#include "vector_clones.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace terrane {
namespace {

/// Eight samples side by side. Unsigned, so that a hostile tile's absurd numbers wrap around.
constexpr int kLanes = 8;
using Unsigned = uint32_t __attribute__((vector_size(4 * kLanes)));
using Signed = int32_t __attribute__((vector_size(4 * kLanes)));
using Floats = float __attribute__((vector_size(4 * kLanes)));
using Bytes = uint8_t __attribute__((vector_size(kLanes)));

/// The same bits as another type of vector.
template <class To, class From>
TERRANE_INLINE To asBits(From from) {
  static_assert(sizeof(To) == sizeof(From));
  To to;
  std::memcpy(&to, &from, sizeof(to));
  return to;
}

TERRANE_INLINE Unsigned magnitude(Unsigned value) {
  const Unsigned sign = 0U - (value >> 31);
  return (value ^ sign) - sign;
}

/// Rows of the planes around row y of one kind of samples, as offsets from its own column.
struct Row {
  const int32_t* values;
  TERRANE_INLINE Unsigned operator()(int x) const {
    Unsigned loaded;
    std::memcpy(&loaded, values + x, sizeof(loaded));
    return loaded;
  }
};

/// What the stencil of a kind sees at one sample: a value near it, and the pairs of neighbours.
template <int Count>
struct Stencil {
  Unsigned base;
  std::array<Unsigned, Count> pairs;  ///< sums of two neighbours

  TERRANE_INLINE Unsigned predict(const std::array<uint32_t, kLargestPairCount>& weights) const {
    Unsigned sum{};
    for (size_t i = 0; i < Count; ++i) sum += weights[i] * (pairs[i] - 2 * base);
    return base + asBits<Unsigned>(asBits<Signed>(sum + 64) >> 7);
  }
};

struct QuadRows {
  Row p0, p1, p2, p3;  ///< corner rows y - 1 to y + 2
  explicit QuadRows(const LevelPlanes& planes, int y)
      : p0{planes.corners.row(y - 1)},
        p1{planes.corners.row(y)},
        p2{planes.corners.row(y + 1)},
        p3{planes.corners.row(y + 2)} {}
  TERRANE_INLINE Stencil<8> stencil(int x) const {
    return {p1(x),
            {p1(x) + p2(x + 1), p1(x + 1) + p2(x), p0(x) + p3(x + 1), p0(x + 1) + p3(x),
             p1(x - 1) + p2(x + 2), p1(x + 2) + p2(x - 1), p0(x - 1) + p3(x + 2), p0(x + 2) + p3(x - 1)}};
  }
  TERRANE_INLINE Unsigned size(int x, const Stencil<8>& s, Unsigned) const {
    const auto second = [](Unsigned a, Unsigned b, Unsigned c) { return magnitude(a - 2 * b + c); };
    const Unsigned bends = second(p1(x - 1), p1(x), p1(x + 1)) + second(p1(x), p1(x + 1), p1(x + 2)) +
                           second(p2(x - 1), p2(x), p2(x + 1)) + second(p2(x), p2(x + 1), p2(x + 2)) +
                           second(p0(x), p1(x), p2(x)) + second(p1(x), p2(x), p3(x)) +
                           second(p0(x + 1), p1(x + 1), p2(x + 1)) + second(p1(x + 1), p2(x + 1), p3(x + 1));
    const Unsigned slopes = magnitude(p1(x) - p2(x + 1)) + magnitude(p1(x + 1) - p2(x));
    return 5 * slopes + 28 * magnitude(s.pairs[0] - s.pairs[1]) + 24 * bends;
  }
  TERRANE_INLINE Unsigned ends(int x, const Stencil<8>& s, int y) const {
    // Squares' hypotenuses alternate; x is even here.
    constexpr Unsigned kOddLanes = {0, ~0U, 0, ~0U, 0, ~0U, 0, ~0U};
    const Unsigned isOther = kOddLanes ^ (0U - static_cast<uint32_t>((x + y) & 1));
    return s.pairs[0] ^ ((s.pairs[0] ^ s.pairs[1]) & isOther);
  }
};

struct HorizontalRows {
  Row p0, p1, p2;      ///< corner rows y - 1 to y + 1
  Row d0, d1, d2, d3;  ///< quad-centre rows y - 2 to y + 1
  Row m1, m2;          ///< misses of quad-centre rows y - 1 and y
  explicit HorizontalRows(const LevelPlanes& planes, int y)
      : p0{planes.corners.row(y - 1)},
        p1{planes.corners.row(y)},
        p2{planes.corners.row(y + 1)},
        d0{planes.quads.row(y - 2)},
        d1{planes.quads.row(y - 1)},
        d2{planes.quads.row(y)},
        d3{planes.quads.row(y + 1)},
        m1{planes.quadMisses.row(y - 1)},
        m2{planes.quadMisses.row(y)} {}
  TERRANE_INLINE Stencil<8> stencil(int x) const {
    return {p1(x),
            {p1(x) + p1(x + 1), d1(x) + d2(x), p1(x - 1) + p1(x + 2), p0(x) + p2(x + 1), p0(x + 1) + p2(x),
             d1(x - 1) + d2(x + 1), d1(x + 1) + d2(x - 1), d0(x) + d3(x)}};
  }
  TERRANE_INLINE Unsigned size(int x, const Stencil<8>& s, Unsigned predicted) const {
    const Unsigned slopes = 4 * magnitude(p1(x) - p1(x + 1)) + magnitude(d1(x) - d2(x));
    const Unsigned bends =
        30 * magnitude(s.pairs[0] - 2 * predicted) + 30 * magnitude(s.pairs[0] + s.pairs[1] - 4 * predicted);
    const Unsigned misses = 82 * (m1(x) + m2(x)) + 60 * (m1(x - 1) + m2(x - 1) + m1(x + 1) + m2(x + 1));
    return slopes + 32 * magnitude(s.pairs[0] - s.pairs[1]) + bends + misses;
  }
  TERRANE_INLINE Unsigned ends(int, const Stencil<8>& s, int) const { return s.pairs[0]; }
};

struct VerticalRows {
  Row p0, p1, p2, p3;  ///< corner rows y - 1 to y + 2
  Row d0, d1, d2;      ///< quad-centre rows y - 1 to y + 1
  Row h1, h2;          ///< horizontal edges' rows y and y + 1
  Row m0, m1, m2;      ///< misses of the quad-centres
  Row n1, n2;          ///< misses of the horizontal edges
  explicit VerticalRows(const LevelPlanes& planes, int y)
      : p0{planes.corners.row(y - 1)},
        p1{planes.corners.row(y)},
        p2{planes.corners.row(y + 1)},
        p3{planes.corners.row(y + 2)},
        d0{planes.quads.row(y - 1)},
        d1{planes.quads.row(y)},
        d2{planes.quads.row(y + 1)},
        h1{planes.horizontal.row(y)},
        h2{planes.horizontal.row(y + 1)},
        m0{planes.quadMisses.row(y - 1)},
        m1{planes.quadMisses.row(y)},
        m2{planes.quadMisses.row(y + 1)},
        n1{planes.horizontalMisses.row(y)},
        n2{planes.horizontalMisses.row(y + 1)} {}
  TERRANE_INLINE Stencil<10> stencil(int x) const {
    return {p1(x),
            {p1(x) + p2(x), d1(x - 1) + d1(x), h1(x - 1) + h2(x), h1(x) + h2(x - 1), p0(x) + p3(x),
             p1(x - 1) + p2(x + 1), p1(x + 1) + p2(x - 1), d0(x - 1) + d2(x), d0(x) + d2(x - 1),
             d1(x - 2) + d1(x + 1)}};
  }
  TERRANE_INLINE Unsigned size(int x, const Stencil<10>& s, Unsigned predicted) const {
    const Unsigned slopes = 3 * magnitude(p1(x) - p2(x)) + magnitude(d1(x - 1) - d1(x));
    const Unsigned bends = 8 * magnitude(s.pairs[0] - 2 * predicted) +
                           22 * magnitude(s.pairs[0] + s.pairs[1] - 4 * predicted) +
                           16 * magnitude(s.pairs[2] - s.pairs[3]);
    const Unsigned misses = 45 * (m1(x - 1) + m1(x)) + 25 * (m0(x - 1) + m0(x) + m2(x - 1) + m2(x)) +
                            95 * (n1(x - 1) + n1(x) + n2(x - 1) + n2(x));
    return slopes + 17 * magnitude(s.pairs[0] - s.pairs[1]) + bends + misses;
  }
  TERRANE_INLINE Unsigned ends(int, const Stencil<10>& s, int) const { return s.pairs[0]; }
};

/// Calls visit(first, end) with the samples of each run of eights.
template <class Visit>
TERRANE_INLINE void forEachRun(uint32_t eights, Visit&& visit) {
  while (eights != 0) {
    const int first = std::countr_zero(eights);
    const int end = first + std::countr_one(eights >> first);
    visit(first * kLanes, end * kLanes);
    eights = eights >> end << end;
  }
}

template <class Rows>
TERRANE_INLINE void predictEight(const Rows& rows, int x, int y,
                                 const std::array<uint32_t, kLargestPairCount>& weights, RowPrediction& out) {
  const auto stencil = rows.stencil(x);
  const Unsigned predicted = stencil.predict(weights);
  const Unsigned bend = 2 * predicted - rows.ends(x, stencil, y);
  // The exponent and the first two bits of a float are a logarithm in quarters of an octave.
  const Unsigned size = (rows.size(x, stencil, predicted) & 0x3fffffffU) + 60;
  const Signed quarters = asBits<Signed>(__builtin_convertvector(asBits<Signed>(size), Floats)) >> 21;
  const Signed context = quarters - 531;
  const Signed tooLarge = context >= kSizeContexts;
  const Bytes narrow =
      __builtin_convertvector((context & ~tooLarge) | ((kSizeContexts - 1) & tooLarge), Bytes);
  std::memcpy(out.values.data() + x, &predicted, sizeof(predicted));
  std::memcpy(out.bend.data() + x, &bend, sizeof(bend));
  std::memcpy(out.context.data() + x, &narrow, sizeof(narrow));
}

template <class Rows>
TERRANE_INLINE void predictWith(const Rows& rows, int y, uint32_t eights, const PairWeights& weights,
                                RowPrediction& out) {
  std::array<uint32_t, kLargestPairCount> wide{};
  for (size_t i = 0; i < wide.size(); ++i) wide[i] = static_cast<uint32_t>(static_cast<int32_t>(weights[i]));
  forEachRun(eights, [&](int first, int end) TERRANE_INLINE_LAMBDA {
    for (int x = first; x < end; x += kLanes) predictEight(rows, x, y, wide, out);
  });
}

TERRANE_CLONES void predictQuads(const QuadRows& rows, int y, uint32_t eights, const PairWeights& weights,
                                 RowPrediction& out) {
  predictWith(rows, y, eights, weights, out);
}
TERRANE_CLONES void predictHorizontal(const HorizontalRows& rows, int y, uint32_t eights,
                                      const PairWeights& weights, RowPrediction& out) {
  predictWith(rows, y, eights, weights, out);
}
TERRANE_CLONES void predictVertical(const VerticalRows& rows, int y, uint32_t eights,
                                    const PairWeights& weights, RowPrediction& out) {
  predictWith(rows, y, eights, weights, out);
}

// ------------------------------------------------------------------------------------------------ fitting

/// Sums of products over a row's samples: of the pairs with each other, and with what is to be predicted.
/// All are whole numbers below 2^53, so that the order of addition does not matter.
template <int Count>
struct NormalEquations {
  std::array<std::array<double, Count + 1>, Count> sums{};
  std::array<std::array<float, RowPrediction::kRoom>, Count + 1> columns;
  int shift = 0;  ///< differences are halved so often that their products stay exact
};

template <int Count, class Rows>
TERRANE_INLINE void gatherColumns(const Rows& rows, const int32_t* target, const uint8_t* counts, int count,
                                  NormalEquations<Count>& out) {
  const int shift = out.shift;
  const auto store = [&](size_t column, int x, Unsigned value, Signed mask) {
    const Signed scaled = asBits<Signed>(value) >> shift;
    const Signed above = scaled > 4095;
    const Signed below = scaled < -4095;
    const Signed bounded = (scaled & ~above & ~below) | (4095 & above) | (-4095 & below);
    const Floats floats = __builtin_convertvector(bounded & mask, Floats);
    std::memcpy(out.columns[column].data() + x, &floats, sizeof(floats));
  };
  for (int x = 0; x < count; x += kLanes) {
    Signed mask{};
    for (int lane = 0; lane < kLanes && x + lane < count; ++lane)
      mask[lane] = -static_cast<int32_t>(counts[x + lane]);
    const auto stencil = rows.stencil(x);
    for (size_t i = 0; i < Count; ++i) store(i, x, stencil.pairs[i] - 2 * stencil.base, mask);
    store(Count, x, Row{target}(x)-stencil.base, mask);
  }
}

template <int Count>
TERRANE_INLINE void addProducts(int count, NormalEquations<Count>& out) {
  for (size_t i = 0; i < Count; ++i) {
    for (size_t j = i; j <= Count; ++j) {
      // note: whole numbers below 2^24 times a thousand: every order of addition gives the same.
      std::array<double, kLanes> sums{};
      for (int x = 0; x < count; x += kLanes) {
        for (size_t lane = 0; lane < kLanes; ++lane) {
          const size_t at = static_cast<size_t>(x) + lane;
          sums[lane] += static_cast<double>(out.columns[i][at] * out.columns[j][at]);
        }
      }
      double sum = 0.0;
      for (const double part : sums) sum += part;
      out.sums[i][j] += sum;
    }
  }
}

TERRANE_CLONES void addQuadRow(const QuadRows& rows, const int32_t* target, const uint8_t* counts, int count,
                               NormalEquations<8>& out) {
  gatherColumns<8>(rows, target, counts, count, out);
  addProducts<8>(count, out);
}
TERRANE_CLONES void addHorizontalRow(const HorizontalRows& rows, const int32_t* target, const uint8_t* counts,
                                     int count, NormalEquations<8>& out) {
  gatherColumns<8>(rows, target, counts, count, out);
  addProducts<8>(count, out);
}
TERRANE_CLONES void addVerticalRow(const VerticalRows& rows, const int32_t* target, const uint8_t* counts,
                                   int count, NormalEquations<10>& out) {
  gatherColumns<10>(rows, target, counts, count, out);
  addProducts<10>(count, out);
}

/// Solves by elimination, a little damped so that flat ground has an answer too.
template <int Count>
PairWeights solve(NormalEquations<Count>& equations, const PairWeights& usual) {
  auto& a = equations.sums;
  double trace = 0.0;
  for (size_t i = 0; i < Count; ++i) trace += a[i][i];
  const double damping = 1.0 + trace * 1e-4 / Count;
  for (size_t i = 0; i < Count; ++i) {
    for (size_t j = 0; j < i; ++j) a[i][j] = a[j][i];
    a[i][i] += damping;
    a[i][Count] += damping * usual[i] / 128.0;
  }
  for (size_t i = 0; i < Count; ++i) {
    for (size_t row = i + 1; row < Count; ++row) {
      const double factor = a[row][i] / a[i][i];
      for (size_t j = i; j <= Count; ++j) a[row][j] -= factor * a[i][j];
    }
  }
  PairWeights out{};
  std::array<double, Count> solution{};
  for (size_t i = Count; i-- > 0;) {
    double value = a[i][Count];
    for (size_t j = i + 1; j < Count; ++j) value -= a[i][j] * solution[j];
    solution[i] = value / a[i][i];
    out[i] = static_cast<int8_t>(std::lround(std::clamp(solution[i] * 128.0, -127.0, 127.0)));
  }
  return out;
}

}  // namespace

const PairWeights& usualWeights(SampleKind kind) {
  static constexpr std::array<PairWeights, kSampleKinds> kUsual = {{
      {36, 36, -2, -2, -2, -2, 0, 0, 0, 0},
      {36, 40, -2, -2, -2, -3, -3, -1, 0, 0},
      {24, 30, 14, 14, -3, -3, -3, -3, -3, -1},
  }};
  return kUsual[static_cast<size_t>(kind)];
}

void predictRow(const LevelPlanes& planes, SampleKind kind, int y, uint32_t eights,
                const PairWeights& weights, RowPrediction& out) {
  switch (kind) {
    case SampleKind::QuadCenter:
      return predictQuads(QuadRows(planes, y), y, eights, weights, out);
    case SampleKind::HorizontalEdge:
      return predictHorizontal(HorizontalRows(planes, y), y, eights, weights, out);
    case SampleKind::VerticalEdge:
      return predictVertical(VerticalRows(planes, y), y, eights, weights, out);
  }
}

TERRANE_CLONES void setMisses(const int32_t* __restrict values, const RowPrediction& predicted,
                              uint32_t eights, int32_t* __restrict misses) {
  constexpr int32_t kMost = 1 << 20;
  const int32_t* __restrict expected = predicted.values.data();
  forEachRun(eights, [&](int first, int end) TERRANE_INLINE_LAMBDA {
    for (int x = first; x < end; ++x) {
      const auto miss =
          static_cast<int32_t>(static_cast<uint32_t>(values[x]) - static_cast<uint32_t>(expected[x]));
      misses[x] = std::max(std::min(miss, kMost), -std::max(miss, -kMost));
    }
  });
}

TERRANE_CLONES void setMeans(const LevelPlanes& planes, SampleKind kind, int y, int count,
                             int32_t* __restrict values) {
  const int32_t* north = planes.corners.row(y);
  const int32_t* south = planes.corners.row(y + 1);
  for (int x = 0; x < count; x += kLanes) {
    const Row n{north}, s{south};
    Unsigned ends;
    if (kind == SampleKind::QuadCenter) {
      constexpr Unsigned kOddLanes = {0, ~0U, 0, ~0U, 0, ~0U, 0, ~0U};
      const Unsigned isOther = kOddLanes ^ (0U - static_cast<uint32_t>(y & 1));
      const Unsigned usual = n(x) + s(x + 1);
      ends = usual ^ ((usual ^ (n(x + 1) + s(x))) & isOther);
    } else {
      ends = n(x) + (kind == SampleKind::HorizontalEdge ? n(x + 1) : s(x));
    }
    const Signed mean = asBits<Signed>(ends) >> 1;
    std::memcpy(values + x, &mean, sizeof(mean));
  }
}

TERRANE_CLONES bool addResiduals(const int32_t* __restrict predicted, const int32_t* __restrict residuals,
                                 int count, const ElevationScale& scale, int32_t* __restrict values,
                                 int32_t* __restrict misses, float* __restrict heights) {
  constexpr int32_t kMost = 1 << 20;
  const double offset = scale.heightOffset;
  const double step = scale.heightStep;
  int32_t low = 0;
  int32_t high = 0;
  for (int x = 0; x < count; ++x) {
    const auto value =
        static_cast<int32_t>(static_cast<uint32_t>(predicted[x]) + static_cast<uint32_t>(residuals[x]));
    values[x] = value;
    low = std::min(low, value);
    high = std::max(high, value);
    misses[x] = std::max(std::min(residuals[x], kMost), -std::max(residuals[x], -kMost));
  }
  for (int x = 0; x < count; ++x)
    heights[x] = static_cast<float>(offset + static_cast<double>(values[x]) * step);
  return high <= kLargestInteger && low >= -kLargestInteger;
}

TERRANE_CLONES void stepsOf(const float* heights, int stride, int count, const ElevationScale& scale,
                            int32_t* __restrict steps) {
  constexpr double kLimit = 1 << 25;
  const double offset = scale.heightOffset;
  const double stepsPerMeter = 1.0 / scale.heightStep;
  std::array<float, RowPrediction::kRoom> taken;
  if (stride == 2) {
    for (size_t x = 0; x < static_cast<size_t>(count); ++x) taken[x] = heights[2 * x];
  } else {
    for (size_t x = 0; x < static_cast<size_t>(count); ++x)
      taken[x] = heights[x * static_cast<size_t>(stride)];
  }
  for (size_t x = 0; x < static_cast<size_t>(count); ++x) {
    const double value = (static_cast<double>(taken[x]) - offset) * stepsPerMeter;
    // note: clamped and made positive before the cast, which is then the floor and never out of range.
    steps[x] = static_cast<int32_t>(std::min(std::max(value, -kLimit), kLimit) + (kLimit + 0.5)) -
               static_cast<int32_t>(kLimit);
  }
}

#if defined(__x86_64__)
namespace {

__attribute__((target("avx2"))) void spreadsOfAvx2(const uint8_t* contexts, int count,
                                                   const SpreadShifts& shifts, uint8_t* spreads) {
  const __m256i table =
      _mm256_broadcastsi128_si256(_mm_loadu_si128(reinterpret_cast<const __m128i*>(shifts.data())));
  const __m256i most = _mm256_set1_epi8(kSpreads - 1);
  for (int x = 0; x < count; x += 32) {
    const __m256i context = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(contexts + x));
    const __m256i octave = _mm256_and_si256(_mm256_srli_epi16(context, 2), _mm256_set1_epi8(15));
    const __m256i spread = _mm256_add_epi8(context, _mm256_shuffle_epi8(table, octave));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(spreads + x),
                        _mm256_max_epi8(_mm256_min_epi8(spread, most), _mm256_setzero_si256()));
  }
}

}  // namespace
#endif

void spreadsOf(const uint8_t* contexts, int count, const SpreadShifts& shifts, uint8_t* spreads) {
#if defined(__x86_64__)
  static const bool hasAvx2 = __builtin_cpu_supports("avx2") != 0;
  if (hasAvx2) return spreadsOfAvx2(contexts, count, shifts, spreads);
#endif
  for (int x = 0; x < count; ++x) spreads[x] = spreadOf(contexts[x], shifts);
}

namespace {

/// Sums up every fourth row of a plane.
template <class Rows, int Count, class AddRow>
PairWeights fitPlane(const LevelPlanes& planes, const SamplePlane& plane, SampleKind kind,
                     const uint8_t* counts, int shift, AddRow addRow) {
  NormalEquations<Count> equations;
  equations.shift = shift;
  for (int y = 1; y < plane.rows(); y += 4)
    addRow(Rows(planes, y), plane.row(y), counts + y * plane.cols(), plane.cols(), equations);
  return solve(equations, usualWeights(kind));
}

}  // namespace

PairWeights fitWeights(const LevelPlanes& planes, SampleKind kind, const uint8_t* counts) {
  int32_t low = planes.corners.row(0)[0];
  int32_t high = low;
  for (int y = 0; y < planes.corners.rows(); ++y) {
    const int32_t* row = planes.corners.row(y);
    const auto [least, most] = std::minmax_element(row, row + planes.corners.cols());
    low = std::min(low, *least);
    high = std::max(high, *most);
  }
  const int shift = std::max(
      0, static_cast<int>(std::bit_width(static_cast<uint32_t>(high) - static_cast<uint32_t>(low))) - 13);
  switch (kind) {
    case SampleKind::QuadCenter:
      return fitPlane<QuadRows, 8>(planes, planes.quads, kind, counts, shift, addQuadRow);
    case SampleKind::HorizontalEdge:
      return fitPlane<HorizontalRows, 8>(planes, planes.horizontal, kind, counts, shift, addHorizontalRow);
    case SampleKind::VerticalEdge:
      break;
  }
  return fitPlane<VerticalRows, 10>(planes, planes.vertical, kind, counts, shift, addVerticalRow);
}

}  // namespace terrane
