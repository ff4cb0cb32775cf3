#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "rans.h"
#include "sample_planes.h"
#include "terrane/codec/tile.h"

/// What the samples that are known let one expect of the next ones: a value, and how far off it may be.
/// docs/format/elevation-v4.md, "Prediction", has the stencils as pictures and the numbers.
namespace terrane {

/// The three kinds of new samples of a lattice level, in the order in which they become known.
enum class SampleKind : uint8_t { QuadCenter = 0, HorizontalEdge = 1, VerticalEdge = 2 };
inline constexpr int kSampleKinds = 3;

/// Neighbours count in pairs that lie opposite each other; a pair's weight is in 1/128.
inline constexpr int kLargestPairCount = 10;
constexpr int pairCount(SampleKind kind) {
  return kind == SampleKind::VerticalEdge ? 10 : 8;
}
using PairWeights = std::array<int8_t, kLargestPairCount>;
/// Weights that suit most ground, where a tile's own would not pay for their bytes.
const PairWeights& usualWeights(SampleKind kind);

/// The grids of one lattice level with n x n quads, as step numbers, and the sizes of what prediction got
/// wrong.
struct LevelPlanes {
  SamplePlane corners;     ///< n + 1 x n + 1
  SamplePlane quads;       ///< n x n
  SamplePlane horizontal;  ///< n + 1 rows of n
  SamplePlane vertical;    ///< n rows of n + 1
  SamplePlane quadMisses;
  SamplePlane horizontalMisses;

  SamplePlane& of(SampleKind kind) {
    return kind == SampleKind::QuadCenter       ? quads
           : kind == SampleKind::HorizontalEdge ? horizontal
                                                : vertical;
  }
};

/// Contexts: by the expected size of a miss, four an octave.
inline constexpr int kSizeContexts = 64;

/// One row of expectations; arrays have room for whole vectors.
struct RowPrediction {
  static constexpr int kRoom = 160;
  alignas(64) std::array<int32_t, kRoom> values;   ///< expected step numbers
  alignas(64) std::array<uint8_t, kRoom> context;  ///< 0 to kSizeContexts - 1
  alignas(
      64) std::array<int32_t, kRoom> bend;  ///< value less the mean of the hypotenuse's ends, in half steps
};

/// All samples of a row, as a bit for each eight of them: what is done for many at once may be done for some
/// eights only.
constexpr uint32_t allEights(int count) {
  return (1U << ((count + 7) / 8)) - 1;
}

/// Predicts row y of a kind of samples from the planes before it, whose rims must be made.
void predictRow(const LevelPlanes& planes, SampleKind kind, int y, uint32_t eights,
                const PairWeights& weights, RowPrediction& out);

/// Step numbers stay exact in a float.
inline constexpr int32_t kLargestInteger = (1 << 24) - 1;

/// The sizes of what a row's predictions missed, bounded to 2^20.
void setMisses(const int32_t* values, const RowPrediction& predicted, uint32_t eights, int32_t* misses);

/// What the samples of a row have as step numbers where they are not coded: the means of their ends. Whole
/// vectors are written.
void setMeans(const LevelPlanes& planes, SampleKind kind, int y, int count, int32_t* values);

/// Samples in a row that are all coded: predictions and residuals make values, misses and heights. False
/// where a value is beyond +- kLargestInteger.
bool addResiduals(const int32_t* predicted, const int32_t* residuals, int count, const ElevationScale& scale,
                  int32_t* values, int32_t* misses, float* heights);

/// How far a tile's numbers are spread, compared with what their contexts say: one number for each octave,
/// within +- 64.
inline constexpr int kOctaves = kSizeContexts / 4;
using SpreadShifts = std::array<int8_t, kOctaves>;
constexpr uint8_t spreadOf(uint8_t context, const SpreadShifts& shifts) {
  return static_cast<uint8_t>(std::clamp(context + shifts[context >> 2], 0, kSpreads - 1));
}
/// The spreads of samples in a row by their contexts. Whole vectors are written.
void spreadsOf(const uint8_t* contexts, int count, const SpreadShifts& shifts, uint8_t* spreads);

/// Nearest step numbers of heights, every `stride` of them; exact doubles in a fixed order, so that every
/// machine gets the same.
void stepsOf(const float* heights, int stride, int count, const ElevationScale& scale, int32_t* steps);

/// The weights that fit a complete level best, by least squares over every fourth row; exact whole-number
/// sums, so that every machine finds the same. `counts`: for each of the kind's samples, row by row, 1 where
/// it matters, 0 where not.
PairWeights fitWeights(const LevelPlanes& planes, SampleKind kind, const uint8_t* counts);

}  // namespace terrane
