#include <algorithm>

#include "pyramid_steps.h"

namespace terrane {

namespace {

constexpr int kHalf = kTileCells / 2;

/// How much of a tile is ground, for its parent: the finest cells under each 2 x 2 of its cells.
struct GroundCounts {
  bool uniform = true;
  uint64_t each = 0;             ///< where uniform
  std::vector<uint64_t> counts;  ///< kHalf * kHalf, where not
  uint64_t at(int index) const { return uniform ? each : counts[static_cast<size_t>(index)]; }
};

/// Covers one tile whose children are covered.
class TileCoverer {
 public:
  TileCoverer(Pyramid& pyramid, int level, const std::vector<GroundCounts>& below)
      : pyramid_(pyramid), below_(below), cell_(uint64_t{1} << (2 * (pyramid.finestLevel() - level))) {}

  Status cover(PyramidTile& tile, std::vector<SampleState>& states, GroundCounts& counts) const {
    if (coverUniformly(tile, counts)) return {};
    TERRANE_TRY(pyramid_.readStates(tile, states));
    const auto isGround = [&](int x, int y) {
      return states[static_cast<size_t>(y * kTileSamples + x)] != SampleState::Void;
    };
    const auto hasGroundCorners = [&](int col, int row) {
      return isGround(col, row) && isGround(col + 1, row) && isGround(col, row + 1) &&
             isGround(col + 1, row + 1);
    };

    // Two by two cells at a time: set their bits, sum them up for the parent.
    counts.uniform = false;
    counts.counts.assign(static_cast<size_t>(kHalf) * kHalf, 0);
    std::vector<uint8_t> bits(Coverage::kBytes, 0);
    int covered = 0;
    for (int row = 0; row < kTileCells; ++row) {
      for (int col = 0; col < kTileCells; ++col) {
        const int quadrant = (col >= kHalf ? 1 : 0) + (row >= kHalf ? 2 : 0);
        const int32_t child = tile.children[static_cast<size_t>(quadrant)];
        const uint64_t ground = child >= 0
                                    ? below_[static_cast<size_t>(child)].at(row % kHalf * kHalf + col % kHalf)
                                : hasGroundCorners(col, row) ? cell_
                                                             : 0;
        counts.counts[static_cast<size_t>(row / 2 * kHalf + col / 2)] += ground;
        if (2 * ground < cell_) continue;
        const int bit = row * kTileCells + col;
        bits[static_cast<size_t>(bit >> 3)] |= static_cast<uint8_t>(1U << (bit & 7));
        ++covered;
      }
    }
    if (covered == 0) {
      tile.coverage.kind = Coverage::Kind::None;
    } else if (covered == kTileCellCount) {
      tile.coverage.kind = Coverage::Kind::Full;
    } else {
      tile.coverage.kind = Coverage::Kind::Partial;
      tile.coverage.bits = std::move(bits);
    }
    return {};
  }

 private:
  /// The tile is ground throughout, or nowhere.
  bool coverUniformly(PyramidTile& tile, GroundCounts& counts) const {
    bool full = true;
    for (const int32_t child : tile.children) {
      if (child < 0)
        full = full && (tile.states < 0 || tile.complete);
      else
        full = full && below_[static_cast<size_t>(child)].uniform &&
               below_[static_cast<size_t>(child)].each == cell_;
    }
    if (!full) return false;
    tile.coverage.kind = Coverage::Kind::Full;
    counts.each = 4 * cell_;
    return true;
  }

  Pyramid& pyramid_;
  const std::vector<GroundCounts>& below_;
  uint64_t cell_;  ///< finest cells under one cell of this level
};

}  // namespace

Result<double> coverTiles(Pyramid& pyramid, const Workers& workers) {
  std::vector<GroundCounts> below;
  std::vector<std::vector<SampleState>> scratches(static_cast<size_t>(workers.count()),
                                                  std::vector<SampleState>(kTileSampleCount));
  for (int level = pyramid.finestLevel(); level >= 0; --level) {
    auto& tiles = pyramid.levels[static_cast<size_t>(level)];
    std::vector<GroundCounts> counts(tiles.size());
    const TileCoverer coverer(pyramid, level, below);
    const Status done = workers.forEach(static_cast<int64_t>(tiles.size()), [&](int worker, int64_t i) {
      const auto index = static_cast<size_t>(i);
      return coverer.cover(tiles[index], scratches[static_cast<size_t>(worker)], counts[index]);
    });
    TERRANE_TRY(done);
    below = std::move(counts);
  }
  double total = 0.0;
  for (int i = 0; i < kHalf * kHalf; ++i) total += static_cast<double>(below[0].at(i));
  return total;
}

}  // namespace terrane
