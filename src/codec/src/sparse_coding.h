#pragma once

#include <array>
#include <cstdint>

#include "binary_coding.h"
#include "level_states.h"

/// Samples of tiles of which some are Interpolated: for each whether it has a height of its own, and if so
/// its residual, in answers (docs/format/elevation-v4.md, "Sparse tiles").
namespace terrane {

/// What the answers about a tile's samples have taught so far.
struct SparseModels {
  static constexpr size_t kBends = 10;   ///< classes of the bend's size
  static constexpr size_t kSizes = 24;   ///< size contexts
  static constexpr size_t kMisses = 10;  ///< classes of residuals' sizes
  static constexpr size_t kSteps = 16;   ///< up to which a residual is said one by one

  struct OfKind {
    // Has it a height of its own?
    std::array<AnswerModel, kBends * kSizes> ownByBend;
    std::array<AnswerModel, 256 * 4> ownByCoded;
    std::array<AnswerModel, kMisses * 6 * 6> ownByMisses;
    std::array<AnswerMixer<3>, 8> ownMixers;
    // Is its residual zero? Negative?
    std::array<AnswerModel, kSizes> zeroBySize;
    std::array<AnswerModel, 2 * kBends * 5> zeroByBend;
    std::array<AnswerModel, 25 * 4> zeroByResiduals;
    AnswerMixer<3> zeroMixer;
    std::array<AnswerModel, 2 * kBends> signByBend;
    std::array<AnswerModel, 9> signByResiduals;
    AnswerMixer<2> signMixer;
  };
  std::array<OfKind, kSampleKinds> kinds;
  // Is it larger than so many?
  std::array<AnswerModel, kSizes * kSteps> largerBySize;
  std::array<AnswerModel, kMisses * kSteps> largerByResiduals;
  std::array<AnswerMixer<2>, 4> largerMixers;

  SparseModels();
};

/// The residuals of a row, bounded; 0 where not Coded.
using RowResiduals = std::array<int16_t, RowPrediction::kRoom>;

/// A row of samples, before and after.
struct SparseRow {
  SampleKind kind;
  int y;
  const RowBits& asked;  ///< of which samples it is said whether they are Coded
  const RowBits* known;  ///< of these, those that are, as layers before say, with values; null: none
  const RowPrediction& predicted;
  const LevelStates& states;  ///< of the rows and passes before
  LevelPlanes& planes;        ///< values: the step numbers of Coded samples; the writer's are there
  const RowResiduals& north;  ///< those of the row before
  RowResiduals& residuals;    ///< all 0 before
};

/// Codes which samples of a row are Coded, and their values: the writer finds both there, the reader leaves
/// them there; both find those of what is known. `coded`: nothing but samples that are asked about. False
/// where a value is beyond
/// +- kLargestInteger.
template <class Coder>
bool codeSparseRow(Coder& coder, SparseModels& models, const SparseRow& row, RowBits& coded);
extern template bool codeSparseRow(BinaryWriter& coder, SparseModels& models, const SparseRow& row,
                                   RowBits& coded);
extern template bool codeSparseRow(BinaryReader& coder, SparseModels& models, const SparseRow& row,
                                   RowBits& coded);

}  // namespace terrane
