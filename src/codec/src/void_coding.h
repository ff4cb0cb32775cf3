#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "binary_coding.h"
#include "level_states.h"

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
      RowBits coded;
      LevelStates::take(row, 2 * s, n + 1, coded, corners_[static_cast<size_t>(y)]);
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
    const Around around = aroundRow(grid, y);
    if (!(around.any() & RowBits::first(grid.cols)).any()) {
      const bool differs = coder.code(models.rowDiffers.chance, !Coder::kReads && row.any());
      models.rowDiffers.learn(differs, kMost);
      if (!differs) return row;
    }
    // note: a coder of our own, of which nobody else knows, stays in registers.
    Coder own = std::move(coder);
    for (int x = 0; x < grid.cols; x += kRun)
      codeRun(own, models, around, x, std::min(kRun, grid.cols - x), northOf(grid.kind, y), row);
    coder = std::move(own);
    return row;
  }

 private:
  static constexpr int kMost = 60;

  /// Which of a row's ends and apexes are void: one of the four of each sample. On the tile's border an end
  /// stands for an apex that is missing.
  struct Around {
    std::array<RowBits, 4> voids;

    RowBits any() const { return voids[0] | voids[1] | voids[2] | voids[3]; }
  };
  Around aroundRow(const Grid& grid, int y) const {
    const auto at = static_cast<size_t>(y);
    const RowBits& north = corners_[at];
    switch (grid.kind) {
      case SampleKind::QuadCenter:
        return {{north, north.fromEast(), corners_[at + 1], corners_[at + 1].fromEast()}};
      case SampleKind::HorizontalEdge: {
        const RowBits east = north.fromEast();
        return {{north, east, y > 0 ? quads_[at - 1] : north, y < grid.rows - 1 ? quads_[at] : east}};
      }
      case SampleKind::VerticalEdge:
        break;
    }
    const RowBits& south = corners_[at + 1];
    RowBits west = quads_[at].fromWest();
    RowBits east = quads_[at];
    if (north.at(0)) west.set(0);
    if (south.at(grid.cols - 1)) east.set(grid.cols - 1);
    return {{north, south, west, east}};
  }
  /// The row before of the same kind, if there is one.
  const RowBits* northOf(SampleKind kind, int y) {
    return y > 0 ? &rowsOf(kind)[static_cast<size_t>(y - 1)] : nullptr;
  }

  /// Sixteen samples or less: together where all around them are alike, else one by one.
  template <class Coder>
  TERRANE_INLINE static void codeRun(Coder& coder, VoidModels& models, const Around& around, int x, int count,
                                     const RowBits* north, RowBits& row) {
    const uint32_t all = (1U << count) - 1;
    std::array<uint32_t, 4> voids;
    for (size_t i = 0; i < 4; ++i) voids[i] = around.voids[i].around(x) & all;
    const bool anyVoid = (voids[0] | voids[1] | voids[2] | voids[3]) != 0;
    const bool anyGround = (voids[0] & voids[1] & voids[2] & voids[3]) != all;
    if (!anyVoid || !anyGround) {
      const uint32_t expected = anyVoid ? all : 0;
      AnswerModel& model = models.differs[anyVoid ? 1 : 0];
      const bool differs = coder.code(model.chance, !Coder::kReads && row.from(x, count) != expected);
      model.learn(differs, kMost);
      if (!differs) {
        if (Coder::kReads && anyVoid) row.setRun(x, all);
        return;
      }
    }
    const uint32_t northern = north != nullptr ? north->around(x) : 0;
    const uint32_t known = Coder::kReads ? 0 : row.from(x, count);
    bool west = x > 0 && row.at(x - 1);
    uint32_t found = 0;
    for (int i = 0; i < count; ++i) {
      const uint32_t sum =
          (voids[0] >> i & 1) + (voids[1] >> i & 1) + (voids[2] >> i & 1) + (voids[3] >> i & 1);
      // Beyond the tile it is as with most around.
      if (x + i == 0) west = sum >= 2;
      const bool isVoidNorth = north != nullptr ? (northern >> i & 1) != 0 : sum >= 2;
      AnswerModel& model = models.isVoid[sum + (west ? 5 : 0) + (isVoidNorth ? 10 : 0)];
      west = coder.code(model.chance, (known >> i & 1) != 0);
      model.learn(west, kMost);
      found |= (west ? 1U : 0U) << i;
    }
    if (Coder::kReads) row.setRun(x, found);
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

  std::vector<RowBits> corners_;
  std::vector<RowBits> quads_;
  std::vector<RowBits> horizontal_;
  std::vector<RowBits> vertical_;
};

}  // namespace terrane
