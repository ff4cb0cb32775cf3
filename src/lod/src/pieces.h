#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "patch_ground.h"
#include "terrane/tiling/lattice.h"

namespace terrane {

/// A triangle, and the split that made it.
struct Piece {
  Triangle triangle;
  int split;  ///< which one of the selection's; -1 for the two that nothing made
  PatchGround ground;
  /// By it diamonds of one level are ordered: by x, then by y.
  uint64_t order() const {
    return static_cast<uint64_t>(triangle.diamond.x) << 32 | static_cast<uint32_t>(triangle.diamond.y);
  }
};

/// The triangles of one diamond that are there, one or two.
struct Pieces {
  std::array<const Piece*, 2> items{};
  int count = 0;
  const Piece* const* begin() const { return items.data(); }
  const Piece* const* end() const { return items.data() + count; }
  const Diamond& diamond() const { return items[0]->triangle.diamond; }
  /// In the order of their apexes.
  void add(const Piece& piece) {
    items[static_cast<size_t>(count++)] = &piece;
    if (count == 2 && items[1]->triangle.apex < items[0]->triangle.apex) std::swap(items[0], items[1]);
  }
};

/// The triangles of one bintree level. They are added in the order of the diamonds whose splits make them,
/// and then taken diamond by diamond, in order too.
class PieceLevel {
 public:
  void add(const Piece& piece) { runs_[runOf(piece.triangle)].push_back(piece); }
  bool isEmpty() const {
    return std::all_of(runs_.begin(), runs_.end(), [](const auto& run) { return run.empty(); });
  }
  void clear() {
    for (auto& run : runs_) run.clear();
    at_ = {};
  }
  /// The triangles of the first diamond that is left; none after the last one. Valid until the next clear().
  Pieces take() {
    constexpr uint64_t kNone = UINT64_MAX;
    uint64_t first = kNone;
    for (size_t run = 0; run < kRuns; ++run)
      if (at_[run] < runs_[run].size()) first = std::min(first, runs_[run][at_[run]].order());
    Pieces pieces;
    if (first == kNone) return pieces;
    for (size_t run = 0; run < kRuns; ++run)
      if (at_[run] < runs_[run].size() && runs_[run][at_[run]].order() == first)
        pieces.add(runs_[run][at_[run]++]);
    return pieces;
  }

 private:
  /// What the splits of one level make, by where it lies from the middle of its diamond: as the diamonds are
  /// gone through in order, each of the runs is in order by itself.
  static constexpr size_t kRuns = 4;
  static size_t runOf(const Triangle& t) {
    const int x = t.diamond.x - t.apex.x, y = t.diamond.y - t.apex.y;
    if (x == 0) return y < 0 ? 1 : 2;
    return x < 0 ? (y > 0 ? 1 : 0) : (y < 0 ? 2 : 3);
  }

  std::array<std::vector<Piece>, kRuns> runs_;
  std::array<size_t, kRuns> at_{};  ///< the first of each run that is left
};

}  // namespace terrane
