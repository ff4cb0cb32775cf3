#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "binary_coding.h"
#include "sample_grid.h"

/// Samples of tiles of which some are Interpolated: for each whether it has a height of its own, and if so
/// its residual, in answers (docs/format/elevation-v4.md, "Sparse tiles").
namespace terrane {

/// What the answers about a tile's samples have taught so far.
struct SparseModels {
  static constexpr size_t kKinds = 3;
  static constexpr size_t kBends = 10;   ///< classes of the bend's size
  static constexpr size_t kSizes = 24;   ///< size contexts
  static constexpr size_t kMisses = 10;  ///< classes of residuals' sizes
  static constexpr size_t kSteps = 16;   ///< up to which a residual is said one by one

  // Has it a height of its own?
  std::array<AnswerModel, kKinds * kBends * kSizes> ownByBend;
  std::array<AnswerModel, kKinds * 256 * 4> ownByCoded;
  std::array<AnswerModel, kKinds * kMisses * 6 * 6> ownByMisses;
  std::array<AnswerMixer<3>, kKinds * 8> ownMixers;
  // Is its residual zero? Negative? Larger than so many?
  std::array<AnswerModel, kKinds * kSizes> zeroBySize;
  std::array<AnswerModel, kKinds * 2 * kBends * 5> zeroByBend;
  std::array<AnswerModel, kKinds * 25 * 4> zeroByResiduals;
  std::array<AnswerMixer<3>, kKinds> zeroMixers;
  std::array<AnswerModel, kKinds * 2 * kBends> signByBend;
  std::array<AnswerModel, kKinds * 9> signByResiduals;
  std::array<AnswerMixer<2>, kKinds> signMixers;
  std::array<AnswerModel, kSizes * kSteps> largerBySize;
  std::array<AnswerModel, kMisses * kSteps> largerByResiduals;
  std::array<AnswerMixer<2>, 4> largerMixers;

  SparseModels();
};

/// A row of samples, before and after. The writer finds all of it there; for the reader states are Void or
/// anything else, and it fills in the rest.
struct SparseRow {
  const Grid& grid;
  int y;
  bool closed;  ///< no sample is Coded whose parent in this tile is Interpolated
  const RowPrediction& predicted;
  SampleState* states;    ///< of the tile
  LevelPlanes& planes;    ///< values: step numbers, those of samples that are not Coded as well
  int8_t* lastResiduals;  ///< those of the row before, bounded, 0 where not Coded; then this row's
};

/// Codes which samples of a row are Coded, and their values. False where a value is beyond
/// +- kLargestInteger.
template <class Coder>
bool codeSparseRow(Coder& coder, SparseModels& models, const SparseRow& row);
extern template bool codeSparseRow(BinaryWriter& coder, SparseModels& models, const SparseRow& row);
extern template bool codeSparseRow(BinaryReader& coder, SparseModels& models, const SparseRow& row);

}  // namespace terrane
