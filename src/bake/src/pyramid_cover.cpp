#include <algorithm>
#include <array>

#include "pyramid_steps.h"

namespace terrane {

namespace {

constexpr int kHalf = kTileCells / 2;

constexpr auto kCounts = static_cast<size_t>(kHalf * kHalf);

/// How much of a tile is ground, for its parent: the finest cells under each 2 x 2 of its cells.
using GroundCounts = std::vector<uint64_t>;

/// What became of a tile.
struct CoverOutcome {
  Coverage::Kind kind = Coverage::Kind::None;
  bool throughout = false;  ///< every finest cell is ground; else there are counts
};

struct CoverScratch {
  std::vector<SampleState> states = std::vector<SampleState>(kTileSampleCount);
  std::array<GroundCounts, 4> below;
  GroundCounts counts;
  std::vector<uint8_t> bits;
};

/// Covers one tile whose children are covered.
class TileCoverer {
 public:
  TileCoverer(Pyramid& pyramid, BlockStore& counts, int level, const std::vector<CoverOutcome>& below)
      : pyramid_(pyramid),
        counts_(counts),
        level_(static_cast<size_t>(level)),
        below_(below),
        cell_(uint64_t{1} << (2 * (pyramid.finestLevel() - level))) {}

  Result<CoverOutcome> cover(const PyramidTile& tile, CoverScratch& scratch) const {
    if (isGroundThroughout(tile)) return CoverOutcome{Coverage::Kind::Full, true};
    std::vector<SampleState>& states = scratch.states;
    TERRANE_TRY(pyramid_.readStates(tile, states));
    for (size_t quadrant = 0; quadrant < 4; ++quadrant) {
      const int32_t child = tile.children[quadrant];
      if (child < 0) continue;
      scratch.below[quadrant].assign(kCounts, cell_);
      if (below_[static_cast<size_t>(child)].throughout) continue;
      const PyramidTile& childTile = pyramid_.levels[level_ + 1][static_cast<size_t>(child)];
      TERRANE_TRY(
          counts_.readValues<uint64_t>(static_cast<uint64_t>(childTile.block), scratch.below[quadrant]));
    }
    const auto isGround = [&](int x, int y) {
      return states[static_cast<size_t>(y * kTileSamples + x)] != SampleState::Void;
    };
    const auto hasGroundCorners = [&](int col, int row) {
      return isGround(col, row) && isGround(col + 1, row) && isGround(col, row + 1) &&
             isGround(col + 1, row + 1);
    };

    // Two by two cells at a time: set their bits, sum them up for the parent.
    scratch.counts.assign(kCounts, 0);
    scratch.bits.assign(Coverage::kBytes, 0);
    int covered = 0;
    for (int row = 0; row < kTileCells; ++row) {
      for (int col = 0; col < kTileCells; ++col) {
        const int quadrant = (col >= kHalf ? 1 : 0) + (row >= kHalf ? 2 : 0);
        const int32_t child = tile.children[static_cast<size_t>(quadrant)];
        const auto inChild = static_cast<size_t>(row % kHalf * kHalf + col % kHalf);
        const uint64_t ground = child >= 0 ? scratch.below[static_cast<size_t>(quadrant)][inChild]
                                : hasGroundCorners(col, row) ? cell_
                                                             : 0;
        scratch.counts[static_cast<size_t>(row / 2 * kHalf + col / 2)] += ground;
        if (2 * ground < cell_) continue;
        const int bit = row * kTileCells + col;
        scratch.bits[static_cast<size_t>(bit >> 3)] |= static_cast<uint8_t>(1U << (bit & 7));
        ++covered;
      }
    }
    const auto block = static_cast<uint64_t>(tile.block);
    TERRANE_TRY(counts_.writeValues<uint64_t>(block, scratch.counts));
    if (covered == 0) return CoverOutcome{Coverage::Kind::None, false};
    if (covered == kTileCellCount) return CoverOutcome{Coverage::Kind::Full, false};
    TERRANE_TRY(pyramid_.writeCoverageBits(tile, scratch.bits));
    return CoverOutcome{Coverage::Kind::Partial, false};
  }

  bool isGroundThroughout(const PyramidTile& tile) const {
    return std::all_of(tile.children.begin(), tile.children.end(), [&](int32_t child) {
      return child < 0 ? !tile.hasStates || tile.complete : below_[static_cast<size_t>(child)].throughout;
    });
  }

 private:
  Pyramid& pyramid_;
  BlockStore& counts_;
  size_t level_;
  const std::vector<CoverOutcome>& below_;
  uint64_t cell_;  ///< finest cells under one cell of this level
};

}  // namespace

Result<double> coverTiles(Pyramid& pyramid, const Scratch& scratch, Jobs& jobs) {
  BlockStore counts(kCounts * sizeof(uint64_t), scratch, "ground");
  std::vector<CoverScratch> scratches(static_cast<size_t>(jobs.workers().count()));
  std::vector<CoverOutcome> below;
  for (int level = pyramid.finestLevel(); level >= 0; --level) {
    // Tiles that are ground throughout are no jobs.
    auto& tiles = pyramid.levels[static_cast<size_t>(level)];
    const TileCoverer coverer(pyramid, counts, level, below);
    std::vector<CoverOutcome> outcomes(tiles.size(), {Coverage::Kind::Full, true});
    std::vector<size_t> others;
    for (size_t i = 0; i < tiles.size(); ++i) {
      if (!coverer.isGroundThroughout(tiles[i])) others.push_back(i);
    }
    const auto done = jobs.run<CoverOutcome>(
        fmt::format("covering {}", level), static_cast<int64_t>(others.size()), nullptr,
        [&](int worker, int64_t i) {
          return coverer.cover(tiles[others[static_cast<size_t>(i)]], scratches[static_cast<size_t>(worker)]);
        });
    if (!done.ok()) return done.error();
    for (size_t i = 0; i < others.size(); ++i) outcomes[others[i]] = (*done)[i];
    for (size_t i = 0; i < tiles.size(); ++i) tiles[i].coverage = outcomes[i].kind;
    below = std::move(outcomes);
  }

  const uint64_t cell = uint64_t{1} << (2 * pyramid.finestLevel());
  if (below[0].throughout) return static_cast<double>(cell) * kTileCellCount;
  GroundCounts root(kCounts);
  TERRANE_TRY(counts.readValues<uint64_t>(static_cast<uint64_t>(pyramid.levels[0][0].block), root));
  double total = 0.0;
  for (const uint64_t count : root) total += static_cast<double>(count);
  return total;
}

}  // namespace terrane
