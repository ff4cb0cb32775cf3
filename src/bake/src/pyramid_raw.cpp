#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pyramid_steps.h"
#include "significance.h"

namespace terrane {

namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// Elevation payloads keep step numbers below 2^24, so that a float holds them exactly.
constexpr double kLargestInteger = 16777215.0;

/// What one worker needs for one tile.
struct RawScratch {
  std::unique_ptr<SourceReader> reader;
  std::vector<float> heights = std::vector<float>(kSamplesOfTile);
  std::vector<float> nativeHeights = std::vector<float>(kSamplesOfTile);
  std::vector<float> childHeights = std::vector<float>(kSamplesOfTile);
  std::vector<uint16_t> ranks = std::vector<uint16_t>(kSamplesOfTile);
  std::vector<uint16_t> nativeRanks = std::vector<uint16_t>(kSamplesOfTile);
  std::vector<uint16_t> childRanks = std::vector<uint16_t>(kSamplesOfTile);
  std::vector<SampleState> states = std::vector<SampleState>(kSamplesOfTile);
  std::vector<SampleState> childStates = std::vector<SampleState>(kSamplesOfTile);
  std::vector<uint8_t> layers = std::vector<uint8_t>(kSamplesOfTile);
  std::vector<uint8_t> childLayers = std::vector<uint8_t>(kSamplesOfTile);
  std::vector<float> given;  ///< heights before they are put on the step
};

/// What became of one candidate.
struct RawOutcome {
  double sum = 0.0;
  int64_t samples = 0;
  bool active = false;
  bool hasData = false;
  bool complete = false;
  bool rough = false;
  bool hasStates = false;
  bool hasNeeds = false;
  bool hasLayers = false;
  uint8_t unused = 0;
};

/// A candidate and its outcome.
struct Candidate {
  TileId id;
  int64_t block = 0;
  RawOutcome outcome;
};

/// Puts heights on the step; what is not finite becomes none. Gives the largest step number in size.
/// `kUnit`: the step is 1 m and the offset 0.
template <bool kUnit>
double quantiseTo(std::span<float> heights, const ElevationScale& scale) {
  double largest = 0.0;
  for (float& height : heights) {
    const auto meters = static_cast<double>(height);
    const double steps = kUnit ? meters : (meters - scale.heightOffset) / scale.heightStep;
    const double size = std::abs(steps);
    const bool present = std::isfinite(height);
    largest = present && size > largest ? size : largest;
    // note: written so that the cast never sees what an int32 cannot hold; halves go away from zero.
    const double bounded = size < kLargestInteger ? steps : 0.0;
    const auto q = static_cast<double>(static_cast<int32_t>(bounded + (bounded < 0.0 ? -0.5 : 0.5)));
    height = present ? static_cast<float>(kUnit ? q : scale.heightOffset + q * scale.heightStep) : kNone;
  }
  return largest;
}
double quantise(std::span<float> heights, const ElevationScale& scale) {
  return scale.heightStep == 1.0 && scale.heightOffset == 0.0 ? quantiseTo<true>(heights, scale)
                                                              : quantiseTo<false>(heights, scale);
}

int countPresent(const std::vector<float>& heights) {
  int count = 0;
  for (const float height : heights) count += std::isnan(height) ? 0 : 1;
  return count;
}

/// Lays heights over others where there are any; adds them up.
void layOver(const std::vector<float>& above, std::vector<float>& heights, RawOutcome& outcome) {
  // Four sums side by side, since one alone would wait for itself.
  constexpr size_t kLanes = 4;
  std::array<double, kLanes> sums{};
  std::array<int64_t, kLanes> counts{};
  const auto add = [&](size_t i, size_t lane) {
    const float height = above[i];
    const bool none = std::isnan(height);
    sums[lane] += none ? 0.0 : static_cast<double>(height);
    counts[lane] += none ? 0 : 1;
    heights[i] = none ? heights[i] : height;
  };
  size_t i = 0;
  for (; i + kLanes <= kSamplesOfTile; i += kLanes) {
    for (size_t lane = 0; lane < kLanes; ++lane) add(i + lane, lane);
  }
  for (; i < kSamplesOfTile; ++i) add(i, 0);
  outcome.sum += (sums[0] + sums[1]) + (sums[2] + sums[3]);
  outcome.samples += (counts[0] + counts[1]) + (counts[2] + counts[3]);
}

/// A child's every second sample into its quadrant of the parent.
template <class T>
void decimate(const std::vector<T>& child, int quadrant, std::vector<T>& parent) {
  const int firstX = (quadrant & 1) * (kTileCells / 2);
  const int firstY = (quadrant >> 1) * (kTileCells / 2);
  for (int y = 0; y <= kTileCells / 2; ++y) {
    const T* from = child.data() + 2 * y * kTileSamples;
    T* to = parent.data() + (firstY + y) * kTileSamples + firstX;
    for (int x = 0; x <= kTileCells / 2; ++x) {
      // note: siblings hold the same samples on their common border, or one of them is not there.
      to[x] = from[2 * x];
    }
  }
}

/// The tiles of one level that may hold data.
std::vector<TileId> candidatesOf(int level, bool native, const Source& source, const Pyramid& pyramid) {
  std::vector<TileId> out;
  if (level < pyramid.finestLevel()) {
    for (const PyramidTile& child : pyramid.levels[static_cast<size_t>(level) + 1]) {
      if (out.empty() || out.back() != child.id.parent()) out.push_back(child.id.parent());
    }
  }
  if (native) {
    const SourcePlan& plan = source.plan();
    const int shift = plan.frame.finestLevel - level + 8;
    const auto last = [&](int64_t samples) {
      return static_cast<int>(std::min<int64_t>((samples - 1) >> shift, (int64_t{1} << level) - 1));
    };
    const int lastCol = last(plan.extentCols);
    const int lastRow = last(plan.extentRows);
    for (int row = 0; row <= lastRow; ++row) {
      for (int col = 0; col <= lastCol; ++col) {
        if (source.mayTouch({level, col, row})) out.push_back({level, col, row});
      }
    }
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

/// Empty tiles around those with data, where they are not there yet. note: the diamonds on a tile's border
/// have a half in the neighbour, which must be there for them to split, ground or not.
std::vector<TileId> neighboursOf(const std::vector<Candidate>& candidates) {
  std::vector<TileId> there, out;
  for (const Candidate& candidate : candidates) {
    if (candidate.outcome.active) there.push_back(candidate.id);
  }
  for (const Candidate& candidate : candidates) {
    if (!candidate.outcome.hasData) continue;
    const TileId id = candidate.id;
    for (int row = id.row - 1; row <= id.row + 1; ++row) {
      for (int col = id.col - 1; col <= id.col + 1; ++col) {
        const TileId neighbour{id.level, col, row};
        if (neighbour.valid() && !std::binary_search(there.begin(), there.end(), neighbour))
          out.push_back(neighbour);
      }
    }
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

/// Makes one tile out of its children and its own level's inputs.
class RawTileMaker {
 public:
  RawTileMaker(const Source& source, const ElevationScale& scale, Pyramid& pyramid, RankStores* ranks,
               NeedStore* needs)
      : source_(source), scale_(scale), pyramid_(pyramid), ranks_(ranks), needs_(needs) {}

  Status make(const PyramidTile& tile, bool native, RawScratch& scratch, RawOutcome& outcome) const {
    const TileId id = tile.id;
    std::fill(scratch.heights.begin(), scratch.heights.end(), kNone);
    if (ranks_ != nullptr) std::fill(scratch.ranks.begin(), scratch.ranks.end(), uint16_t{0});

    // What the level below has.
    bool anyStates = false, anyLayers = false;
    for (int quadrant = 0; id.level < pyramid_.finestLevel() && quadrant < 4; ++quadrant) {
      const int index = pyramid_.find(id.child(quadrant));
      if (index < 0) continue;
      const PyramidTile& child =
          pyramid_.levels[static_cast<size_t>(id.level) + 1][static_cast<size_t>(index)];
      outcome.active = true;
      TERRANE_TRY(pyramid_.readRawHeights(child, scratch.childHeights));
      decimate(scratch.childHeights, quadrant, scratch.heights);
      TERRANE_TRY(takeStates(child, quadrant, scratch, anyStates));
      TERRANE_TRY(takeLayers(child, quadrant, scratch, anyLayers));
      if (ranks_ == nullptr) continue;
      TERRANE_TRY(ranks_->raw.readValues<uint16_t>(static_cast<uint64_t>(child.block), scratch.childRanks));
      decimate(scratch.childRanks, quadrant, scratch.ranks);
    }

    // What the inputs of this level have, where it lies above that.
    bool touched = false;
    if (native && source_.mayTouch(id)) TERRANE_TRY(overlay(id, scratch, outcome, touched));
    if (!outcome.active) return {};

    const int present = countPresent(scratch.heights);
    outcome.complete = present == kTileSampleCount;
    outcome.hasData = present > 0;
    outcome.rough = ranks_ == nullptr && isRough(scratch.heights);
    TERRANE_TRY(pyramid_.writeRawHeights(tile, scratch.heights));
    if (anyStates && std::find(scratch.states.begin(), scratch.states.end(), SampleState::Interpolated) !=
                         scratch.states.end()) {
      TERRANE_TRY(pyramid_.writeStates(tile, scratch.states));
      outcome.hasStates = true;
    }
    if (anyLayers && *std::max_element(scratch.layers.begin(), scratch.layers.end()) > 0) {
      TERRANE_TRY(pyramid_.writeLayers(tile, scratch.layers));
      outcome.hasLayers = true;
    }
    if (outcome.hasData && needs_ != nullptr && id.level == pyramid_.finestLevel()) {
      TERRANE_TRY(writeNeeds(tile, scratch));
      outcome.hasNeeds = true;
    }
    if (ranks_ == nullptr) return {};
    const auto block = static_cast<uint64_t>(tile.block);
    TERRANE_TRY(ranks_->raw.writeValues<uint16_t>(block, scratch.ranks));
    if (!native) return {};
    if (!touched) std::fill(scratch.nativeRanks.begin(), scratch.nativeRanks.end(), uint16_t{0});
    return ranks_->native.writeValues<uint16_t>(block, scratch.nativeRanks);
  }

 private:
  /// A child's states into its quadrant, where it or a sibling before it has other states than Coded.
  Status takeStates(const PyramidTile& child, int quadrant, RawScratch& scratch, bool& takenAny) const {
    if (!child.hasStates && !takenAny) return {};
    if (!takenAny) std::fill(scratch.states.begin(), scratch.states.end(), SampleState::Coded);
    takenAny = true;
    TERRANE_TRY(pyramid_.readStates(child, scratch.childStates));
    decimate(scratch.childStates, quadrant, scratch.states);
    return {};
  }

  /// The same of the layers, where one has others than the first.
  Status takeLayers(const PyramidTile& child, int quadrant, RawScratch& scratch, bool& takenAny) const {
    if (!child.hasLayers && !takenAny) return {};
    if (!takenAny) std::fill(scratch.layers.begin(), scratch.layers.end(), uint8_t{0});
    takenAny = true;
    TERRANE_TRY(pyramid_.readLayers(child, scratch.childLayers));
    decimate(scratch.childLayers, quadrant, scratch.layers);
    return {};
  }

  /// What each layer's bound needs, and what the larger ones before it do.
  Status writeNeeds(const PyramidTile& tile, const RawScratch& scratch) const {
    std::vector<uint8_t> all;
    std::array<uint8_t, kSampleBitsBytes> bits, before{};
    for (const double bound : needs_->boundsMeters) {
      findNeeded(scratch.given, scratch.heights, bound, bits);
      for (size_t i = 0; i < bits.size(); ++i) bits[i] |= before[i];
      all.insert(all.end(), bits.begin(), bits.end());
      before = bits;
    }
    return needs_->bits.writeValues<uint8_t>(static_cast<uint64_t>(tile.block), all);
  }

  Status overlay(TileId id, RawScratch& scratch, RawOutcome& outcome, bool& touched) const {
    TERRANE_ASSIGN(touched, scratch.reader->readTile(id, scratch.nativeHeights, scratch.nativeRanks));
    if (!touched) return {};
    outcome.active = true;
    if (needs_ != nullptr) scratch.given = scratch.nativeHeights;
    const double largest = quantise(scratch.nativeHeights, scale_);
    if (largest > kLargestInteger) {
      return makeError(
          "tile {}: a height of {:.6g} m is {:.3g} steps of {:.3g} m, more than 2^24; allow a larger "
          "--max-error, "
          "or give the value as --nodata if it stands for none",
          toString(id), scale_.heightOffset + largest * scale_.heightStep, largest, scale_.heightStep);
    }
    if (ranks_ == nullptr) {
      layOver(scratch.nativeHeights, scratch.heights, outcome);
      return {};
    }
    for (size_t i = 0; i < kSamplesOfTile; ++i) {
      const float height = scratch.nativeHeights[i];
      if (std::isnan(height)) {
        scratch.nativeRanks[i] = 0;
        continue;
      }
      outcome.sum += static_cast<double>(height);
      ++outcome.samples;
      if (scratch.nativeRanks[i] <= scratch.ranks[i]) continue;
      scratch.heights[i] = height;
      scratch.ranks[i] = scratch.nativeRanks[i];
    }
    return {};
  }

  const Source& source_;
  const ElevationScale& scale_;
  Pyramid& pyramid_;
  RankStores* ranks_;
  NeedStore* needs_;
};

}  // namespace

bool isRough(std::span<const float> heights) {
  for (int y = 0; y < kTileSamples; y += 2) {
    const float* row = heights.data() + y * kTileSamples;
    for (int x = 1; x < kTileSamples; x += 2) {
      const float mean = (row[x - 1] + row[x + 1]) * 0.5F;
      if (std::isfinite(mean) && std::isfinite(row[x]) && row[x] != mean) return true;
    }
  }
  return false;
}

RankStores::RankStores(const Scratch& scratch)
    : raw(kSamplesOfTile * sizeof(uint16_t), scratch, "ranks-raw"),
      native(kSamplesOfTile * sizeof(uint16_t), scratch, "ranks-native"),
      coarse(kSamplesOfTile * sizeof(uint16_t), scratch, "ranks-coarse") {}

Result<RawTotals> readRawTiles(const Source& source, const ElevationScale& scale, Pyramid& pyramid,
                               RankStores* ranks, NeedStore* needs, Jobs& jobs, Progress& progress) {
  const std::vector<int> nativeLevels = source.nativeLevels();
  std::vector<RawScratch> scratches(static_cast<size_t>(jobs.workers().count()));
  TERRANE_CHECK(needs == nullptr || ranks == nullptr, "needs of inputs of {} levels", nativeLevels.size());
  const RawTileMaker maker(source, scale, pyramid, ranks, needs);
  RawTotals totals;
  double sum = 0.0;
  int64_t blocks = 0;

  // Makes tiles and their outcomes; blocks are numbered in the order of the jobs.
  const auto makeAll = [&](const std::string& stage, const std::vector<TileId>& ids, bool native,
                           bool active) -> Result<std::vector<Candidate>> {
    const int64_t firstBlock = blocks;
    blocks += static_cast<int64_t>(ids.size());
    const auto outcomes =
        jobs.run<RawOutcome>(stage, static_cast<int64_t>(ids.size()), native ? &progress : nullptr,
                             [&](int worker, int64_t i) -> Result<RawOutcome> {
                               RawScratch& scratch = scratches[static_cast<size_t>(worker)];
                               if (native && scratch.reader == nullptr) {
                                 TERRANE_ASSIGN(scratch.reader, source.openReader());
                               }
                               PyramidTile tile;
                               tile.id = ids[static_cast<size_t>(i)];
                               tile.block = firstBlock + i;
                               RawOutcome outcome;
                               outcome.active = active;
                               TERRANE_TRY(maker.make(tile, native, scratch, outcome));
                               return outcome;
                             });
    if (!outcomes.ok()) return outcomes.error();
    std::vector<Candidate> made;
    for (size_t i = 0; i < ids.size(); ++i)
      made.push_back({ids[i], firstBlock + static_cast<int64_t>(i), (*outcomes)[i]});
    return made;
  };

  for (int level = pyramid.finestLevel(); level >= 0; --level) {
    const bool native = std::find(nativeLevels.begin(), nativeLevels.end(), level) != nativeLevels.end();
    const std::vector<TileId> ids = candidatesOf(level, native, source, pyramid);
    if (native) progress.beginStage("reading", static_cast<int64_t>(ids.size()), "tiles");
    TERRANE_ASSIGN(const std::vector<Candidate> candidates,
                   makeAll(fmt::format("reading {}", level), ids, native, false));
    TERRANE_ASSIGN(const std::vector<Candidate> around,
                   makeAll(fmt::format("surrounding {}", level), neighboursOf(candidates), false, true));

    // Sums in the tiles' order, so that they do not depend on the threads.
    auto& tiles = pyramid.levels[static_cast<size_t>(level)];
    const auto take = [&](const Candidate& candidate) {
      sum += candidate.outcome.sum;
      totals.samples += candidate.outcome.samples;
      if (!candidate.outcome.active) return;
      PyramidTile tile;
      tile.id = candidate.id;
      tile.block = candidate.block;
      tile.complete = candidate.outcome.complete;
      tile.rough = candidate.outcome.rough;
      tile.hasStates = candidate.outcome.hasStates;
      tile.hasLayers = candidate.outcome.hasLayers;
      tile.hasNeeds = candidate.outcome.hasNeeds;
      tiles.push_back(tile);
    };
    for (const Candidate& candidate : candidates) take(candidate);
    for (const Candidate& candidate : around) take(candidate);
    std::sort(tiles.begin(), tiles.end(),
              [](const PyramidTile& a, const PyramidTile& b) { return a.id < b.id; });
    if (needs != nullptr && level == pyramid.finestLevel())
      TERRANE_TRY(interpolateFinestTiles(pyramid, *needs, jobs));
  }
  if (totals.samples == 0) return totals;
  pyramid.link();
  totals.meanHeight = sum / static_cast<double>(totals.samples);
  return totals;
}

}  // namespace terrane
