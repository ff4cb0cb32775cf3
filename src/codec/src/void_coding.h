#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "binary_coding.h"
#include "row_bits.h"
#include "sample_grid.h"

/// Which samples of a row are void (docs/format/elevation-v4.md, "States").
namespace terrane {

/// The models of a tile: by how many of four neighbours are void and by the samples of the same kind to the
/// west and north; of runs whose surroundings are all alike, by what they are.
struct VoidModels {
  std::array<AnswerModel, 20> isVoid;
  std::array<AnswerModel, 2> differs;
  AnswerModel rowDiffers;
};

/// The void samples of a lattice level, known row by row.
class VoidLevel {
 public:
  /// So many samples of a row are asked about together where all around them is void, or nothing is.
  static constexpr int kRun = 16;

  /// Takes what is known before: the corners.
  void begin(int s, const SampleState* states) {
    const int n = kTileCells / (2 * s);
    resize(corners_, n + 1);
    resize(quads_, n);
    resize(horizontal_, n + 1);
    resize(vertical_, n);
    for (int y = 0; y <= n; ++y) {
      const SampleState* row = states + 2 * y * s * kTileSamples;
      if (std::memchr(row, static_cast<int>(SampleState::Void), kTileSamples) == nullptr) continue;
      for (int x = 0; x <= n; ++x) {
        if (row[2 * x * s] == SampleState::Void) corners_[static_cast<size_t>(y)].set(x);
      }
    }
  }

  /// Codes row y of a kind: the writer finds out from `states`, the reader leaves what it learned in
  /// the result alone.
  template <class Coder>
  const RowBits& codeRow(Coder& coder, VoidModels& models, const Grid& grid, int y,
                         const SampleState* states) {
    std::vector<RowBits>& rows = rowsOf(grid.kind);
    RowBits& row = rows[static_cast<size_t>(y)];
    if constexpr (!Coder::kReads) {
      for (int x = 0; x < grid.cols; ++x) {
        if (states[grid.indexOf(x, y)] == SampleState::Void) row.set(x);
      }
    }
    // The row as a whole, where nothing around it is void.
    if (!isVoidAroundRow(grid, y)) {
      const bool differs = coder.code(models.rowDiffers.chance, !Coder::kReads && row.any());
      models.rowDiffers.learn(differs, kMost);
      if (!differs) return row;
    }
    // note: a coder of our own, of which nobody else knows, stays in registers.
    Coder own = std::move(coder);
    codeRuns(own, models, grid, y, row);
    coder = std::move(own);
    return row;
  }

 private:
  static constexpr int kMost = 60;

  /// Run by run, and sample by sample where a run is not alike.
  template <class Coder>
  TERRANE_INLINE void codeRuns(Coder& coder, VoidModels& models, const Grid& grid, int y, RowBits& row) {
    for (int x = 0; x < grid.cols; x += kRun) {
      const int count = std::min(kRun, grid.cols - x);
      const uint32_t all = (1U << count) - 1;
      const Around around = aroundRun(grid, x, count, y);
      if (!around.anyVoid || !around.anyGround) {
        const uint32_t expected = around.anyVoid ? all : 0;
        AnswerModel& model = models.differs[around.anyVoid ? 1 : 0];
        const bool differs = coder.code(model.chance, !Coder::kReads && row.from(x, count) != expected);
        model.learn(differs, kMost);
        if (!differs) {
          if (Coder::kReads && around.anyVoid) row.setRun(x, all);
          continue;
        }
      }
      for (int i = x; i < x + count; ++i) {
        AnswerModel& model = models.isVoid[contextOf(grid, i, y, row)];
        const bool yes = coder.code(model.chance, !Coder::kReads && row.at(i));
        model.learn(yes, kMost);
        if (Coder::kReads && yes) row.set(i);
      }
    }
  }

  static void resize(std::vector<RowBits>& rows, int count) {
    rows.resize(static_cast<size_t>(count));
    for (RowBits& row : rows) row.clear();
  }
  std::vector<RowBits>& rowsOf(SampleKind kind) {
    return kind == SampleKind::QuadCenter       ? quads_
           : kind == SampleKind::HorizontalEdge ? horizontal_
                                                : vertical_;
  }

  /// Is there anything void among a row's ends and apexes?
  bool isVoidAroundRow(const Grid& grid, int y) const {
    const auto at = static_cast<size_t>(y);
    switch (grid.kind) {
      case SampleKind::QuadCenter:
        return corners_[at].any() || corners_[at + 1].any();
      case SampleKind::HorizontalEdge:
        return corners_[at].any() || (y > 0 && quads_[at - 1].any()) ||
               (y < grid.rows - 1 && quads_[at].any());
      case SampleKind::VerticalEdge:
        break;
    }
    return corners_[at].any() || corners_[at + 1].any() || quads_[at].any();
  }

  /// The ends and apexes of a run of samples, as far as they are in the tile.
  struct Around {
    bool anyVoid = false;
    bool anyGround = false;
  };
  Around aroundRun(const Grid& grid, int x, int count, int y) const {
    Around around;
    const auto look = [&](const RowBits& row, int first, int end) {
      const uint32_t bits = row.from(first, end - first);
      around.anyVoid |= bits != 0;
      around.anyGround |= bits != (1U << (end - first)) - 1;
    };
    const auto at = static_cast<size_t>(y);
    switch (grid.kind) {
      case SampleKind::QuadCenter:
        look(corners_[at], x, x + count + 1);
        look(corners_[at + 1], x, x + count + 1);
        break;
      case SampleKind::HorizontalEdge:
        look(corners_[at], x, x + count + 1);
        if (y > 0) look(quads_[at - 1], x, x + count);
        if (y < grid.rows - 1) look(quads_[at], x, x + count);
        break;
      case SampleKind::VerticalEdge:
        look(corners_[at], x, x + count);
        look(corners_[at + 1], x, x + count);
        look(quads_[at], std::max(x - 1, 0), std::min(x + count, grid.cols - 1));
        break;
    }
    return around;
  }

  TERRANE_INLINE size_t contextOf(const Grid& grid, int x, int y, const RowBits& row) {
    const auto at = static_cast<size_t>(y);
    int voids = 0;
    switch (grid.kind) {
      case SampleKind::QuadCenter:
        voids =
            corners_[at].at(x) + corners_[at].at(x + 1) + corners_[at + 1].at(x) + corners_[at + 1].at(x + 1);
        break;
      case SampleKind::HorizontalEdge: {
        const int west = corners_[at].at(x);
        const int east = corners_[at].at(x + 1);
        // For an apex that is missing an end counts once more.
        voids = west + east + (y > 0 ? int{quads_[at - 1].at(x)} : west) +
                (y < grid.rows - 1 ? int{quads_[at].at(x)} : east);
        break;
      }
      case SampleKind::VerticalEdge: {
        const int north = corners_[at].at(x);
        const int south = corners_[at + 1].at(x);
        voids = north + south + (x > 0 ? int{quads_[at].at(x - 1)} : north) +
                (x < grid.cols - 1 ? int{quads_[at].at(x)} : south);
        break;
      }
    }
    const bool west = x > 0 ? row.at(x - 1) : voids >= 2;
    const bool north = y > 0 ? rowsOf(grid.kind)[at - 1].at(x) : voids >= 2;
    return static_cast<size_t>(voids + (west ? 5 : 0) + (north ? 10 : 0));
  }

  std::vector<RowBits> corners_;
  std::vector<RowBits> quads_;
  std::vector<RowBits> horizontal_;
  std::vector<RowBits> vertical_;
};

}  // namespace terrane
