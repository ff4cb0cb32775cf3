#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pyramid_steps.h"
#include "terrane/codec/elevation_codec.h"

namespace terrane {

namespace {

struct FillScratch {
  std::vector<float> raw = std::vector<float>(kSamplesOfTile);
  std::vector<SampleState> rawStates = std::vector<SampleState>(kSamplesOfTile);
  TileSamples parent;
  std::vector<uint16_t> rawRanks = std::vector<uint16_t>(kSamplesOfTile);
  std::vector<uint16_t> coarseRanks = std::vector<uint16_t>(kSamplesOfTile);
  std::vector<uint16_t> parentRanks = std::vector<uint16_t>(kSamplesOfTile);
  std::vector<uint16_t> parentNativeRanks = std::vector<uint16_t>(kSamplesOfTile);
};

/// The height that ground nearest to a corner of the root has, or `otherwise` where the root shows none: so
/// what lies between the corner and the ground is level with the ground, not a slope to somewhere.
float nearestHeight(const std::vector<float>& heights, LatticePoint corner, float otherwise) {
  float found = otherwise;
  int64_t nearest = std::numeric_limits<int64_t>::max();
  for (int y = 0; y < kTileSamples; ++y) {
    for (int x = 0; x < kTileSamples; ++x) {
      const float height = heights[static_cast<size_t>(y * kTileSamples + x)];
      if (std::isnan(height)) continue;
      const int64_t dx = x - corner.x, dy = y - corner.y;
      if (dx * dx + dy * dy >= nearest) continue;
      nearest = dx * dx + dy * dy;
      found = height;
    }
  }
  return found;
}

/// The root: the lattice from its corners down, each missing sample the mean of its hypotenuse's ends.
/// `states` are those of the samples that are not missing.
void fillRoot(std::vector<float>& heights, std::vector<SampleState>& states, float cornerHeight) {
  for (size_t i = 0; i < kSamplesOfTile; ++i) {
    if (std::isnan(heights[i])) states[i] = SampleState::Void;
  }
  const auto at = [&](LatticePoint p) -> float& {
    return heights[static_cast<size_t>(p.y * kTileSamples + p.x)];
  };
  constexpr std::array<LatticePoint, 4> kCorners = {
      {{0, 0}, {kTileCells, 0}, {0, kTileCells}, {kTileCells, kTileCells}}};
  std::array<float, 4> cornerHeights{};
  for (size_t i = 0; i < 4; ++i) cornerHeights[i] = nearestHeight(heights, kCorners[i], cornerHeight);
  for (size_t i = 0; i < 4; ++i) at(kCorners[i]) = cornerHeights[i];
  const Lattice lattice(0);
  for (int level = 0; level <= lattice.deepestLevel(); ++level) {
    // Quad-centres stand at odd multiples of the half-size, edge-centres where one coordinate is even.
    const int s = lattice.halfSize(level);
    const bool quads = level % 2 == 0;
    for (int y = quads ? s : 0; y <= kTileCells; y += quads ? 2 * s : s) {
      for (int x = quads ? s : (y / s % 2 == 0 ? s : 0); x <= kTileCells; x += 2 * s) {
        const LatticePoint center{x, y};
        if (!std::isnan(at(center))) continue;
        const auto ends = lattice.hypotenuse({x, y, level});
        at(center) = (at(ends[0]) + at(ends[1])) * 0.5F;
      }
    }
  }
}

/// The coarser inputs' ranks on a child's samples: the parent's on every second place, between them the
/// smallest of those that interpolateSamples() asks for ground.
void interpolateRanks(const std::vector<uint16_t>& parent, int quadrant, std::vector<uint16_t>& child) {
  const int firstX = (quadrant & 1) * (kTileCells / 2);
  const int firstY = (quadrant >> 1) * (kTileCells / 2);
  for (int y = 0; y < kTileSamples; ++y) {
    const uint16_t* north = parent.data() + (firstY + y / 2) * kTileSamples + firstX;
    const uint16_t* south = y % 2 == 0 ? north : north + kTileSamples;
    uint16_t* out = child.data() + y * kTileSamples;
    for (int x = 0; x < kTileSamples; ++x) {
      const int west = x / 2;
      const int east = x % 2 == 0 ? west : west + 1;
      out[x] = std::min(std::min(north[west], north[east]), std::min(south[west], south[east]));
    }
  }
}

/// What became of a tile.
struct FillOutcome {
  bool filled = false;
  bool hasStates = false;
};

/// What became of a parent's children.
using FamilyOutcome = std::array<FillOutcome, 4>;

/// Finishes one tile below a finished parent.
class TileFiller {
 public:
  TileFiller(Pyramid& pyramid, RankStores* ranks, std::vector<int> nativeLevels)
      : pyramid_(pyramid), ranks_(ranks), nativeLevels_(std::move(nativeLevels)) {}

  Result<FillOutcome> fill(const PyramidTile& tile, const PyramidTile& parent, FillScratch& scratch) const {
    // With data everywhere and inputs of one level there is nothing to fill.
    if (ranks_ == nullptr && tile.complete) return FillOutcome{tile.filled, tile.hasStates};
    const int quadrant = tile.id.quadrant();
    TERRANE_TRY(pyramid_.readSamples(parent, scratch.parent));
    TERRANE_TRY(pyramid_.readRawHeights(tile, scratch.raw));
    TERRANE_TRY(pyramid_.readStates(tile, scratch.rawStates));
    if (ranks_ != nullptr) TERRANE_TRY(readRanks(tile, parent, quadrant, scratch));

    // Old samples come from the parent, new ones from the inputs where these lie on top.
    TileSamples samples = interpolateSamples(scratch.parent, quadrant);
    bool allCoded = true;
    for (int y = 0; y < kTileSamples; ++y) {
      for (int x = 0; x < kTileSamples; ++x) {
        const auto i = static_cast<size_t>(y * kTileSamples + x);
        SampleState& state = samples.states[i];
        if (x % 2 != 0 || y % 2 != 0) {
          const uint16_t coarse = ranks_ != nullptr ? scratch.coarseRanks[i] : uint16_t{0};
          const bool onTop = ranks_ == nullptr || scratch.rawRanks[i] >= coarse;
          if (!std::isnan(scratch.raw[i]) && onTop) {
            samples.heights[i] = scratch.raw[i];
            state = scratch.rawStates[i];
          } else if (coarse == 0) {
            state = SampleState::Void;  // a hole of the inputs
          }
        }
        allCoded &= state == SampleState::Coded;
      }
    }
    // note: states are overwritten, but those that are read keep their value: done again, it is the same.
    TERRANE_TRY(pyramid_.writeFilledHeights(tile, samples.heights));
    if (!allCoded) TERRANE_TRY(pyramid_.writeStates(tile, samples.states));
    return FillOutcome{true, !allCoded};
  }

 private:
  bool isNative(int level) const {
    return std::find(nativeLevels_.begin(), nativeLevels_.end(), level) != nativeLevels_.end();
  }

  /// Which inputs' data meet here: the tile's own, and those of all coarser levels together.
  Status readRanks(const PyramidTile& tile, const PyramidTile& parent, int quadrant,
                   FillScratch& scratch) const {
    const auto block = static_cast<uint64_t>(tile.block);
    const auto parentBlock = static_cast<uint64_t>(parent.block);
    TERRANE_TRY(ranks_->raw.readValues<uint16_t>(block, scratch.rawRanks));
    if (parent.id.isRoot()) {
      std::fill(scratch.parentRanks.begin(), scratch.parentRanks.end(), uint16_t{0});
    } else {
      TERRANE_TRY(ranks_->coarse.readValues<uint16_t>(parentBlock, scratch.parentRanks));
    }
    if (isNative(parent.id.level)) {
      TERRANE_TRY(ranks_->native.readValues<uint16_t>(parentBlock, scratch.parentNativeRanks));
      for (size_t i = 0; i < kSamplesOfTile; ++i) {
        scratch.parentRanks[i] = std::max(scratch.parentRanks[i], scratch.parentNativeRanks[i]);
      }
    }
    interpolateRanks(scratch.parentRanks, quadrant, scratch.coarseRanks);
    return ranks_->coarse.writeValues<uint16_t>(block, scratch.coarseRanks);
  }

  Pyramid& pyramid_;
  RankStores* ranks_;
  std::vector<int> nativeLevels_;
};

}  // namespace

Status fillTiles(const Source& source, Pyramid& pyramid, RankStores* ranks, float cornerHeight, Jobs& jobs,
                 Progress& progress) {
  int64_t tiles = 0;
  for (const auto& level : pyramid.levels) tiles += static_cast<int64_t>(level.size());
  progress.beginStage("filling", tiles, "tiles");

  PyramidTile& root = pyramid.levels[0][0];
  if (!root.complete) {
    const Status rootDone = jobs.run("filling 0", 1, nullptr, [&](int, int64_t) -> Status {
      std::vector<float> heights(kSamplesOfTile);
      std::vector<SampleState> states(kSamplesOfTile);
      TERRANE_TRY(pyramid.readRawHeights(root, heights));
      TERRANE_TRY(pyramid.readStates(root, states));
      fillRoot(heights, states, cornerHeight);
      TERRANE_TRY(pyramid.writeFilledHeights(root, heights));
      return pyramid.writeStates(root, states);
    });
    TERRANE_TRY(rootDone);
    root.filled = true;
    root.hasStates = true;
  }
  progress.advance(1);

  std::vector<FillScratch> scratches(static_cast<size_t>(jobs.workers().count()));
  const TileFiller filler(pyramid, ranks, source.nativeLevels());
  for (size_t level = 1; level < pyramid.levels.size(); ++level) {
    // A parent's children together. Families in which there is nothing to do are no jobs.
    const auto& above = pyramid.levels[level - 1];
    auto& below = pyramid.levels[level];
    std::vector<const PyramidTile*> parents;
    int64_t members = 0;
    for (const PyramidTile& parent : above) {
      const bool toDo = std::any_of(parent.children.begin(), parent.children.end(), [&](int32_t child) {
        return child >= 0 && (ranks != nullptr || !below[static_cast<size_t>(child)].complete);
      });
      if (toDo) parents.push_back(&parent);
      for (const int32_t child : parent.children) members += child >= 0 ? 1 : 0;
    }
    const auto outcomes = jobs.run<FamilyOutcome>(
        fmt::format("filling {}", level), static_cast<int64_t>(parents.size()), nullptr,
        [&](int worker, int64_t i) -> Result<FamilyOutcome> {
          const PyramidTile& parent = *parents[static_cast<size_t>(i)];
          FamilyOutcome family;
          for (size_t quadrant = 0; quadrant < 4; ++quadrant) {
            const int32_t child = parent.children[quadrant];
            if (child < 0) continue;
            TERRANE_ASSIGN(family[quadrant], filler.fill(below[static_cast<size_t>(child)], parent,
                                                         scratches[static_cast<size_t>(worker)]));
          }
          return family;
        });
    if (!outcomes.ok()) return outcomes.error();
    for (size_t i = 0; i < parents.size(); ++i) {
      for (size_t quadrant = 0; quadrant < 4; ++quadrant) {
        const int32_t child = parents[i]->children[quadrant];
        if (child < 0) continue;
        below[static_cast<size_t>(child)].filled = (*outcomes)[i][quadrant].filled;
        below[static_cast<size_t>(child)].hasStates = (*outcomes)[i][quadrant].hasStates;
      }
    }
    progress.advance(members);
  }
  return {};
}

}  // namespace terrane
