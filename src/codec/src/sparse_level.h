#pragma once

#include <array>
#include <vector>

#include "level_states.h"
#include "sparse_coding.h"

namespace terrane {

/// One lattice level of a sparse tile while it is coded: what is known of its samples' states, and which
/// samples are asked about at all, which is what its cost follows.
class SparseLevel {
 public:
  /// Takes what is known before: the corners. `closed`: no sample is Coded whose parent in this tile is
  /// Interpolated.
  void begin(int s, bool closed, const SampleState* states);
  /// Begins a pass; those before it are done.
  void beginPass(const Grid& grid);

  /// The eights of a row in which predictions matter: where samples are asked about, and of horizontal edges
  /// where vertical ones will be asked by how much the predictions missed.
  uint32_t eights(int y) const { return eightsOf(kind_, y); }
  uint32_t eightsOf(SampleKind kind, int y) const;
  /// The eights of a row of quad-centres by whose misses edges will be asked, once beginPass() of horizontal
  /// edges knows of them.
  uint32_t eightsOfQuadMisses(int y) const;

  /// Would all of these samples of row y be asked about?
  bool asks(int y, const RowBits& samples) const { return !(samples & ~askedIn(kind_, y)).any(); }

  /// Codes row y of the pass as codeSparseRow() does; `coded` has what is known, too, which is all among what
  /// would be asked about.
  template <class Coder>
  bool codeRow(Coder& coder, SparseModels& models, const RowPrediction& predicted, LevelPlanes& planes, int y,
               const RowBits& voids, const RowBits* known, RowBits& coded) {
    const RowBits asked = askedIn(kind_, y) & ~voids;
    RowResiduals& residuals = residuals_[static_cast<size_t>(y % 2)];
    const RowResiduals& north = residuals_[static_cast<size_t>(1 - y % 2)];
    bool isInRange = true;
    if (y > 1 && askedIn(kind_, y - 2).any()) residuals.fill(0);
    if (asked.any()) {
      isInRange = codeSparseRow(
          coder, models, {kind_, y, asked, known, predicted, states_, planes, north, residuals}, coded);
    }
    states_.of(kind_).set(y, coded, voids);
    return isInRange;
  }

 private:
  void takeAsked(SampleKind kind, int rows);
  const RowBits& askedIn(SampleKind kind, int y) const {
    return asked_[static_cast<size_t>(kind)][static_cast<size_t>(y + 1)];
  }

  bool closed_ = false;
  SampleKind kind_ = SampleKind::QuadCenter;
  LevelStates states_;
  std::array<std::vector<RowBits>, kSampleKinds> asked_;  ///< each with an empty row before and after
  std::array<RowResiduals, 2> residuals_{};
};

}  // namespace terrane
