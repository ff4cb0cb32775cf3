#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "terrane/codec/tile.h"

/// Which samples of the finest level a bounded dataset codes, and which it leaves to interpolation: pure
/// functions of a tile's samples. docs/decisions/0030-significance.md says what and why.
///
/// A diamond with the half-size s <= kLargestOptional is *needed* by itself where one of its triangles, drawn
/// as a plane through its corners' heights on the step, leaves the given heights by more than the bound. A
/// sample is *significant* where its diamond or a descendant is needed; all samples on multiples of
/// 2 * kLargestOptional are. So the significant samples are closed under "parent of", and what they make of
/// the samples between, each the mean of its hypotenuse's ends, stays within the bound.
namespace terrane {

/// The largest half-size, in cells, of a diamond that may be left out.
inline constexpr int kLargestOptional = 8;

/// One bit a sample of a tile, in the samples' order, lowest bit first.
inline constexpr size_t kSampleBitsBytes = (kTileSampleCount + 7) / 8;

/// What the triangles inside one tile need: a bit for each diamond that is needed by itself (and perhaps some
/// of its ancestors). `given`: the heights to keep to, NaN where there is none; `onStep`: the same on the
/// step, each within the bound. A triangle with a corner that has no height can only be kept where no sample
/// depends on that corner. note: neighbours agree about the diamonds on their border only once their needs
/// are put together. Cost: about 10 ns a sample where it is smooth, less where it is rough.
void findNeeded(std::span<const float> given, std::span<const float> onStep, double maxErrorMeters,
                std::span<uint8_t, kSampleBitsBytes> needed);

/// The needs of a tile (in the middle) and of its eight neighbours, row by row from the north-west; null
/// where there is no such tile or none of its samples has a height.
using NeedsAround = std::array<const uint8_t*, 9>;

/// What is significant in the middle tile: 1 or 0 a sample, also for samples without a height (whose bits
/// keep the set closed). note: what a diamond's descendants need reaches less than 2 * kLargestOptional cells
/// beyond it, so the neighbours' needs are all that counts.
void findSignificant(const NeedsAround& needs, std::span<uint8_t> significant);

/// Gives every sample that is not significant the mean of its hypotenuse's ends, from coarse to fine, and all
/// samples their state. Samples without a height (NaN) stay so and become Void. A second time changes
/// nothing. Returns whether all samples are Coded.
bool interpolateInsignificant(std::span<const uint8_t> significant, std::span<float> heights,
                              std::span<SampleState> states);

}  // namespace terrane
