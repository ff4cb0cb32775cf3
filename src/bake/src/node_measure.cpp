#include "node_measure.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "leaf_surfaces.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {

namespace {

constexpr auto kSampleCount = static_cast<size_t>(kTileSampleCount);
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Rounding a mean to a float is off by at most this share of it.
constexpr float kRounding = 1.0F / (1 << 24);

/// Nodes of a bintree level stand in tiles of this level.
int tileLevelOfNodes(int bintreeLevel) {
  return bintreeLevel < kFirstInnerNodeLevel ? 0 : (bintreeLevel - kFirstInnerNodeLevel) / 2;
}

/// What is already known of nodes that many tiles raise, so that a tile need not measure what cannot raise
/// them. Only a help: what a tile leaves out, another one has told or will tell.
class KnownErrors {
 public:
  /// Tiles of the finest level share the nodes of tiles four levels up; beyond some levels it is too much to
  /// remember.
  explicit KnownErrors(int finestLevel) : levels_(static_cast<size_t>(std::clamp(finestLevel - 3, 1, 7))) {
    for (size_t level = 0; level < levels_.size(); ++level)
      levels_[level].assign((size_t{1} << (2 * level)) * kMostNodes, 0.0F);
  }
  /// The node's known error, or null where nothing is remembered.
  float* of(TileId tile, int node) {
    if (static_cast<size_t>(tile.level) >= levels_.size()) return nullptr;
    const auto index = (static_cast<size_t>(tile.row) << tile.level) + static_cast<size_t>(tile.col);
    return &levels_[static_cast<size_t>(tile.level)][index * kMostNodes + static_cast<size_t>(node)];
  }

 private:
  std::vector<std::vector<float>> levels_;
};

/// The patches' samples of a bintree level, as a lattice: its spacing is 2^shift of the leaf tile's cells.
struct SurfaceLattice {
  int shift = 0;
  bool quincunx = false;  ///< only its samples with an even sum of coordinates
};
SurfaceLattice surfaceOf(int bintreeLevel, int leafLevel) {
  const bool quincunx = bintreeLevel % 2 != 0;
  // note: rounded down from 8 for even, 7 for odd levels; both differences are even.
  return {leafLevel + ((quincunx ? 7 : 8) - bintreeLevel) / 2, quincunx};
}

void raiseShared(float& value, float candidate) {
  std::atomic_ref<float> shared(value);
  float old = shared.load(std::memory_order_relaxed);
  while (old < candidate && !shared.compare_exchange_weak(old, candidate, std::memory_order_relaxed)) {
  }
}

/// Measures the patches over one tile below which something is not stored.
class LeafMeasurer {
 public:
  LeafMeasurer(const Pyramid& pyramid, KnownErrors& known) : pyramid_(pyramid), known_(known) {}

  /// Gives the range of the tile's ground.
  Result<GroundRange> measure(TileId id, int index, MeasuredNodes& out) {
    out_ = &out;
    out = {};
    id_ = id;
    leaf_ = id.level;
    TERRANE_TRY(readTile(index));
    findAncestors();
    measureRange();
    TERRANE_TRY(measureErrors());
    return GroundRange{lowest_, highest_};
  }

 private:
  Status measureErrors() {
    const TileId id = id_;
    if (lowest_ > highest_) return {};  // no ground
    const TileBisection& bisection = TileBisection::of(id);
    coarseTriangles(bisection);

    // From the finest patches whose surface is not simply these samples, up to the root's.
    for (int n = kFirstInnerNodeLevel + 2 * leaf_; n >= 0; --n) {
      const SurfaceLattice surface = surfaceOf(n, leaf_);
      std::array<float, 4> corners{};
      if (LeafSurfaces::needsCorners(surface.shift)) {
        TERRANE_TRY(cornersOf(surface, corners));
      } else if (isFlat_) {
        continue;
      }
      const float rounding = static_cast<float>(surface.shift + 8) * kRounding * largest_;
      if (surface.shift >= LeafSurfaces::kLinearShift) {
        surfaces_.atSquareCorners(std::min(surface.shift, 8), surface.quincunx, corners, squareCorners_);
        measureWhereNeeded(n, rounding, bisection);
        continue;
      }
      surfaces_.compare(surface.shift, surface.quincunx, corners, values_);
      forEachTriangle(n, bisection, [&](float& node, float*, size_t begin, size_t end) {
        const float most = *std::max_element(values_.begin() + static_cast<ptrdiff_t>(begin),
                                             values_.begin() + static_cast<ptrdiff_t>(end));
        node = std::max(node, most + rounding);
      });
    }
    return {};
  }

  Status readTile(int index) {
    const PyramidTile& tile = pyramid_.levels[static_cast<size_t>(leaf_)][static_cast<size_t>(index)];
    TERRANE_TRY(pyramid_.readHeights(tile, heights_));
    ground_ = heights_;
    if (tile.hasStates && !tile.complete) {
      TERRANE_TRY(pyramid_.readStates(tile, states_));
      for (size_t i = 0; i < kSampleCount; ++i) {
        if (states_[i] == SampleState::Void) ground_[i] = std::numeric_limits<float>::quiet_NaN();
      }
    }
    const auto [low, high] = std::minmax_element(heights_.begin(), heights_.end());
    isFlat_ = *low == *high;
    largest_ = std::max(std::abs(*low), std::abs(*high));
    surfaces_.setTile(id_, heights_, ground_);
    return {};
  }

  void findAncestors() {
    ancestors_.resize(static_cast<size_t>(leaf_) + 1);
    for (int level = 0; level <= leaf_; ++level) {
      ancestors_[static_cast<size_t>(level)] = static_cast<size_t>(pyramid_.find(id_.ancestor(level)));
    }
  }

  /// The ground's range in the tile's own quads; all coarser ranges follow from these.
  void measureRange() {
    surfaces_.range(low_, high_);
    out_->low.fill(kInfinity);
    out_->high.fill(-kInfinity);
    const TileBisection& bisection = TileBisection::of(id_);
    lowest_ = kInfinity;
    highest_ = -kInfinity;
    for (size_t i = 0; i < low_.size(); ++i) {
      const auto quad = static_cast<size_t>(bisection.atoms[i].square);
      out_->low[quad] = std::min(out_->low[quad], low_[i]);
      out_->high[quad] = std::max(out_->high[quad], high_[i]);
      lowest_ = std::min(lowest_, low_[i]);
      highest_ = std::max(highest_, high_[i]);
    }
  }

  /// The triangles that hold the tile's two halves, on every bintree level above the tile's own.
  void coarseTriangles(const TileBisection& bisection) {
    const Lattice lattice(leaf_);
    coarse_.clear();
    const LatticePoint origin{id_.col * kTileCells, id_.row * kTileCells};
    std::array<Triangle, 2> halves;
    for (size_t half = 0; half < 2; ++half) {
      const LatticePoint middle = bisection.centers[0][half];
      const Diamond diamond{origin.x + middle.x, origin.y + middle.y, 2 * leaf_};
      halves[half] = {diamond, lattice.apexes(diamond).items[half]};
    }
    for (int n = 2 * leaf_ - 1; n >= 0; --n) {
      for (Triangle& t : halves) {
        // The parent's hypotenuse is halved at the apex; its apex is an end of our hypotenuse.
        const Diamond parent = lattice.diamondAt(t.apex);
        const auto ends = lattice.hypotenuse(t.diamond);
        const auto apexes = lattice.apexes(parent);
        const bool first = std::find(apexes.begin(), apexes.end(), ends[0]) != apexes.end();
        t = {parent, first ? ends[0] : ends[1]};
      }
      coarse_.push_back({halves[0].diamond.center(), halves[1].diamond.center()});
    }
  }

  /// One sample of the pyramid, at the leaf's lattice coordinates; it must exist at `level`.
  Result<float> heightAt(LatticePoint p, int level) const {
    const TileId tile = id_.ancestor(level);
    const int shift = leaf_ - level;
    return pyramid_.readHeight(
        pyramid_.levels[static_cast<size_t>(level)][ancestors_[static_cast<size_t>(level)]],
        (p.x >> shift) - tile.col * kTileCells, (p.y >> shift) - tile.row * kTileCells);
  }

  /// A surface whose cells are at least as large as the tile, at the tile's four corners.
  Status cornersOf(SurfaceLattice surface, std::array<float, 4>& corners) {
    const int level = std::max(0, leaf_ - surface.shift);
    const int64_t cell = int64_t{1} << surface.shift;
    const LatticePoint origin{id_.col * kTileCells, id_.row * kTileCells};
    int col = static_cast<int>(origin.x / cell);
    int row = static_cast<int>(origin.y / cell);
    const auto sample = [&](int x, int y) {
      return heightAt({static_cast<int32_t>(x * cell), static_cast<int32_t>(y * cell)}, level);
    };
    for (int i = 0; i < 4; ++i) {
      const int x = col + (i & 1);
      const int y = row + (i >> 1);
      float& corner = corners[static_cast<size_t>(i)];
      if (surface.quincunx && (x + y) % 2 != 0) {
        const int dx = x % 2;
        TERRANE_ASSIGN(const float a, sample(x - dx, y - (1 - dx)));
        TERRANE_ASSIGN(const float b, sample(x + dx, y + (1 - dx)));
        corner = (a + b) * 0.5F;
      } else {
        TERRANE_ASSIGN(corner, sample(x, y));
      }
    }

    for (const float corner : corners) largest_ = std::max(largest_, std::abs(corner));

    // Halve the cell until it is the tile.
    for (int shift = surface.shift; shift > 8; --shift) {
      const auto [nw, ne, sw, se] = corners;
      const float middle = (((col + row) & 1) == 0 ? nw + se : ne + sw) * 0.5F;
      const float north = (nw + ne) * 0.5F;
      const float west = (nw + sw) * 0.5F;
      const float east = (ne + se) * 0.5F;
      const float south = (sw + se) * 0.5F;
      col = origin.x >> (shift - 1);
      row = origin.y >> (shift - 1);
      const bool inEast = (col & 1) != 0;
      if ((row & 1) == 0)
        corners = inEast ? std::array{north, ne, middle, east} : std::array{nw, north, west, middle};
      else
        corners = inEast ? std::array{middle, east, south, se} : std::array{west, middle, sw, south};
    }
    return {};
  }

  /// Calls visit(error, what is known of the node or null, first atom, end of atoms) for the tile's part of
  /// every triangle of bintree level n.
  template <class Visit>
  void forEachTriangle(int n, const TileBisection& bisection, Visit&& visit) {
    const int depth = std::max(0, n - 2 * leaf_);
    const size_t atomsEach = size_t{1} << (TileBisection::kDepth - depth);
    for (size_t t = 0; t * atomsEach < TileBisection::kAtoms; ++t) {
      float* error = nullptr;
      float* known = nullptr;
      if (n - 2 * leaf_ == RisingErrors::kDepths) {
        const LatticePoint local = bisection.centers[static_cast<size_t>(depth)][t];
        error = &out_->error[static_cast<size_t>(nodeIndex(depth, local.x, local.y, leaf_ == 0))];
      } else if (n >= 2 * leaf_) {
        error = out_->rising.atDepth(depth) + t;
      } else {
        error = &out_->rising.coarse[static_cast<size_t>(n)][t];
        const int level = tileLevelOfNodes(n);
        const int shift = leaf_ - level;
        const TileId tile = id_.ancestor(level);
        const LatticePoint center = coarse_[static_cast<size_t>(2 * leaf_ - 1 - n)][t];
        known = known_.of(tile, nodeIndex(n - 2 * level, (center.x >> shift) - tile.col * kTileCells,
                                          (center.y >> shift) - tile.row * kTileCells, level == 0));
      }
      visit(*error, known, t * atomsEach, (t + 1) * atomsEach);
    }
  }

  /// For surfaces that are linear over atoms: compares only atoms that can raise their node's error, which
  /// their heights' range and the surface's corners tell. The most promising goes first.
  void measureWhereNeeded(int n, float rounding, const TileBisection& bisection) {
    for (size_t i = 0; i < TileBisection::kAtoms; ++i)
      values_[i] = largestPossible(bisection.atoms[i], i) + rounding;
    forEachTriangle(n, bisection, [&](float& node, float* shared, size_t begin, size_t end) {
      // note: rounding once more, so that what is left out could not have raised the error by a last bit.
      const auto measure = [&](size_t i) {
        const float known =
            shared == nullptr ? node : std::atomic_ref<float>(*shared).load(std::memory_order_relaxed);
        if (values_[i] + rounding <= std::max(node, known)) return;
        node = std::max(node, surfaces_.compareAtom(bisection.atoms[i], squareCorners_) + rounding);
        if (shared != nullptr) raiseShared(*shared, node);
      };
      const auto first = values_.begin() + static_cast<ptrdiff_t>(begin);
      const auto best = std::max_element(first, values_.begin() + static_cast<ptrdiff_t>(end));
      measure(static_cast<size_t>(best - values_.begin()));
      for (size_t i = begin; i < end; ++i) measure(i);
    });
  }

  /// No ground sample in the atom can be farther from the surface; -inf where there is no ground.
  float largestPossible(const TileBisection::Atom& atom, size_t index) const {
    constexpr int kSquares = TileBisection::kSquares;
    const int col = atom.square % kSquares;
    const int row = atom.square / kSquares;
    const float* corner = squareCorners_.data() + row * (kSquares + 1) + col;
    // Three of the square's corners: all but the one across the diagonal.
    const bool falls = ((col + row) & 1) == 0;
    const float a = falls ? corner[0] : corner[1];
    const float b = falls ? corner[kSquares + 2] : corner[kSquares + 1];
    const float c =
        atom.east ? (falls ? corner[1] : corner[kSquares + 2]) : (falls ? corner[kSquares + 1] : corner[0]);
    return std::max(high_[index] - std::min({a, b, c}), std::max({a, b, c}) - low_[index]);
  }

  const Pyramid& pyramid_;
  KnownErrors& known_;
  MeasuredNodes* out_ = nullptr;
  LeafSurfaces surfaces_;
  TileId id_;
  int leaf_ = 0;
  std::vector<float> heights_ = std::vector<float>(kSampleCount);
  std::vector<float> ground_ = std::vector<float>(kSampleCount);
  std::vector<SampleState> states_ = std::vector<SampleState>(kSampleCount);
  std::vector<size_t> ancestors_;
  std::vector<std::array<LatticePoint, 2>> coarse_;
  AtomValues values_;
  AtomValues low_;  ///< of the ground in each atom
  AtomValues high_;
  LeafSurfaces::SquareCorners squareCorners_;
  bool isFlat_ = false;
  float largest_ = 0.0F;
  float lowest_ = 0.0F;
  float highest_ = 0.0F;
};

}  // namespace

Result<GroundRange> measureNodes(Pyramid& pyramid, NodeStores& stores, Jobs& jobs, Progress& progress) {
  // Tiles with a quadrant that nothing stored refines, the finest first.
  struct Leaf {
    int level;
    int index;
  };
  std::vector<Leaf> leaves;
  for (int level = pyramid.finestLevel(); level >= 0; --level) {
    auto& tiles = pyramid.levels[static_cast<size_t>(level)];
    for (size_t i = 0; i < tiles.size(); ++i) {
      if (!tiles[i].stored) continue;
      const bool refined =
          std::all_of(tiles[i].children.begin(), tiles[i].children.end(), [&](int32_t child) {
            return child >= 0 &&
                   pyramid.levels[static_cast<size_t>(level) + 1][static_cast<size_t>(child)].stored;
          });
      tiles[i].measured = !refined;
      if (!refined) leaves.push_back({level, static_cast<int>(i)});
    }
  }

  progress.beginStage("errors", static_cast<int64_t>(leaves.size()), "tiles");
  KnownErrors known(pyramid.finestLevel());
  std::vector<LeafMeasurer> measurers(static_cast<size_t>(jobs.workers().count()),
                                      LeafMeasurer(pyramid, known));
  std::vector<MeasuredNodes> results(measurers.size());
  const auto ranges = jobs.run<GroundRange>(
      "errors", static_cast<int64_t>(leaves.size()), &progress,
      [&](int worker, int64_t i) -> Result<GroundRange> {
        const Leaf leaf = leaves[static_cast<size_t>(i)];
        const PyramidTile& tile =
            pyramid.levels[static_cast<size_t>(leaf.level)][static_cast<size_t>(leaf.index)];
        MeasuredNodes& measured = results[static_cast<size_t>(worker)];
        TERRANE_ASSIGN(const GroundRange range,
                       measurers[static_cast<size_t>(worker)].measure(tile.id, leaf.index, measured));
        TERRANE_TRY(stores.measured.writeValue(static_cast<uint64_t>(tile.block), measured));
        return range;
      });
  if (!ranges.ok()) return ranges.error();
  GroundRange all{kInfinity, -kInfinity};
  for (const GroundRange& range : *ranges) {
    all.low = std::min(all.low, range.low);
    all.high = std::max(all.high, range.high);
  }
  return all;
}

}  // namespace terrane
