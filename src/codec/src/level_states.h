#pragma once

#include <cstddef>
#include <vector>

#include "row_bits.h"
#include "sample_grid.h"

/// Which samples of a lattice level are Coded, as bits of rows: what sparse tiles look at around a sample
/// (docs/format/elevation-v4.md, "Sparse tiles").
namespace terrane {

/// One grid of a level, a row at a time.
class StateRows {
 public:
  /// Everything beyond the grid is Coded.
  void resize(int rows, int cols) {
    inside_ = RowBits::first(cols);
    coded_.resize(static_cast<size_t>(rows + 2 * kRim));
    interpolated_.resize(coded_.size());
    coded_.front() = coded_.back() = ~RowBits();
    interpolated_.front() = interpolated_.back() = RowBits();
  }
  void set(int y, const RowBits& coded, const RowBits& voids) {
    coded_[placeOf(y)] = coded | ~inside_;
    interpolated_[placeOf(y)] = inside_ & ~(coded | voids);
  }
  const RowBits& inside() const { return inside_; }
  const RowBits& coded(int y) const { return coded_[placeOf(y)]; }
  const RowBits& interpolated(int y) const { return interpolated_[placeOf(y)]; }

 private:
  static constexpr int kRim = 1;
  static size_t placeOf(int y) { return static_cast<size_t>(y + kRim); }

  RowBits inside_;
  std::vector<RowBits> coded_;
  std::vector<RowBits> interpolated_;
};

class LevelStates {
 public:
  /// Takes what is known before: the corners.
  void begin(int s, const SampleState* states);
  /// Finds out about a row of samples from their states.
  static void take(const SampleState* states, int stride, int count, RowBits& coded, RowBits& voids);

  StateRows& of(SampleKind kind) {
    return kind == SampleKind::QuadCenter       ? quads_
           : kind == SampleKind::HorizontalEdge ? horizontal_
                                                : vertical_;
  }
  const StateRows& of(SampleKind kind) const { return const_cast<LevelStates*>(this)->of(kind); }
  const StateRows& corners() const { return corners_; }

  /// The samples of a row that have an Interpolated apex.
  RowBits withInterpolatedParent(SampleKind kind, int y) const;

 private:
  StateRows corners_;
  StateRows quads_;
  StateRows horizontal_;
  StateRows vertical_;
};

}  // namespace terrane
