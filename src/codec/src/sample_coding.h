#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sample_prediction.h"
#include "sparse_level.h"
#include "terrane/base/result.h"
#include "terrane/codec/tile.h"
#include "void_coding.h"

/// The samples that a tile holds itself <-> segments of entropy-coded symbols, level by level of the lattice
/// (docs/format/elevation-v4.md, "Samples").
namespace terrane {

/// Which states a tile's own samples have; what needs not be said of each of them.
struct OwnStates {
  bool anyVoid = false;
  bool anyInterpolated = false;
  bool anyCoded = false;
  /// No sample is Coded whose parent in this tile is Interpolated.
  bool closed = true;

  bool isMixed() const { return (anyVoid ? 1 : 0) + (anyInterpolated ? 1 : 0) + (anyCoded ? 1 : 0) > 1; }
  /// Must each sample's state be said, or part of it? Then as answers, and the residuals as well; else
  /// residuals are numbers.
  bool isSparse() const { return anyInterpolated; }
  bool hasVoidAnswers() const { return anyVoid && isMixed(); }
  bool hasAnswers() const { return isMixed(); }
  bool hasNumbers() const { return anyCoded && !isSparse(); }
  bool operator==(const OwnStates&) const = default;
};

/// What a tile's answers teach, from its first segment to the last.
struct SampleModels {
  VoidModels voids;
  SparseModels sparse;
};
OwnStates ownStatesOf(const std::vector<SampleState>& states, bool isRoot);

/// What a layer after the first says of a tile's samples: which of those that are not void are Coded, by
/// answers. `closed`: see OwnStates.
inline OwnStates refinedStates(bool closed) {
  return {.anyVoid = false, .anyInterpolated = true, .anyCoded = true, .closed = closed};
}

/// Appends the segments of a lattice level (half-size s): quad-centres, then edge-centres. `layer`: 0, or
/// which one after it; then `states` are refinedStates(), and what layers before code is not said again.
void encodeLevel(const TileSamples& samples, int s, int layer, const OwnStates& states,
                 const ElevationScale& scale, SampleModels* models, std::vector<uint8_t>& out);

/// The state that a tile's own samples must have before they are decoded.
SampleState usualState(const OwnStates& states);

/// Reads them; the coarser samples must be there. Gives the number of bytes used. Errors are relative to
/// `bytes`. After the first layer, `samples` begin as the one before has them.
Result<size_t> decodeLevel(std::span<const uint8_t> bytes, int s, int layer, const OwnStates& states,
                           const ElevationScale& scale, SampleModels* models, TileSamples& samples);

/// The step number whose height a coded sample has.
int32_t integerOfCoded(float height, const ElevationScale& scale);

}  // namespace terrane
