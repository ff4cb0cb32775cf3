#include <algorithm>

#include "node_measure.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {

namespace {

/// Saturates larger patches on one level whose children's level is done.
class LargeSaturator {
 public:
  LargeSaturator(Pyramid& pyramid, int level, const ElevationScale& scale, double maxErrorMeters)
      : pyramid_(pyramid),
        level_(level),
        isRoot_(level == 0),
        scale_(scale),
        maxErrorMeters_(maxErrorMeters),
        tiles_(pyramid.levels[static_cast<size_t>(level)]),
        nodes_(pyramid.nodes[static_cast<size_t>(level)]) {
    nodes_.largeErrorCode.assign(tiles_.size() * static_cast<size_t>(tileLargeNodeCount(isRoot_)), 0);
  }

  Status saturateTile(size_t index) {
    if (!tiles_[index].stored) return {};
    for (int k = kNodeGrid.k + 1; k <= PatchGrid::kLargest; ++k) {
      // Finest first; within a level in any order.
      for (int level = lastLargeNodeLevel(k); level >= firstLargeNodeLevel(k, isRoot_); --level) {
        TERRANE_TRY(saturateNodeLevel(index, k, level));
      }
    }
    return {};
  }

  /// Edge-centres between two tiles get the same code in both.
  void joinBorders(size_t index) {
    if (isRoot_ || !tiles_[index].stored) return;
    const TileId id = tiles_[index].id;
    for (int k = kNodeGrid.k + 1; k <= PatchGrid::kLargest; ++k) {
      const int s = nodeHalfSize(firstLargeNodeLevel(k, false));
      for (int at = s; at < kTileCells; at += 2 * s) {
        join(k, index, {kTileCells, at}, {level_, id.col + 1, id.row}, {0, at});
        join(k, index, {at, kTileCells}, {level_, id.col, id.row + 1}, {at, 0});
      }
    }
  }

 private:
  uint8_t& code(int level, size_t tile, int k, int nodeLevel, LatticePoint local) const {
    const bool isRoot = level == 0;
    const size_t at = tile * static_cast<size_t>(tileLargeNodeCount(isRoot)) +
                      static_cast<size_t>(largeNodeIndex(k, nodeLevel, local.x, local.y, isRoot));
    return pyramid_.nodes[static_cast<size_t>(level)].largeErrorCode[at];
  }

  /// The largest error measured among the patches for K = 17 that one of this k is made of, in this tile.
  float measuredBelow(size_t tile, int nodeLevel, LatticePoint p, int halvings) const {
    if (p.x < 0 || p.y < 0 || p.x > kTileCells || p.y > kTileCells) return 0.0F;
    if (halvings == 0) {
      return nodes_.error[tile * static_cast<size_t>(nodes_.nodesPerTile) +
                          static_cast<size_t>(nodeIndex(nodeLevel, p.x, p.y, isRoot_))];
    }
    const int h = nodeHalfSize(nodeLevel) / 2;
    const std::array<LatticePoint, 4> steps =
        nodeLevel % 2 == 0 ? std::array<LatticePoint, 4>{{{-h, -h}, {h, -h}, {-h, h}, {h, h}}}
                           : std::array<LatticePoint, 4>{{{-h, 0}, {h, 0}, {0, -h}, {0, h}}};
    float largest = 0.0F;
    for (const LatticePoint step : steps) {
      largest =
          std::max(largest, measuredBelow(tile, nodeLevel + 2, {p.x + step.x, p.y + step.y}, halvings - 1));
    }
    return largest;
  }

  Status saturateNodeLevel(size_t index, int k, int nodeLevel) {
    const int s = nodeHalfSize(nodeLevel);
    const bool quads = nodeLevel % 2 == 0;
    for (int y = quads ? s : 0; y <= kTileCells; y += quads ? 2 * s : s) {
      for (int x = quads ? s : (y / s % 2 == 0 ? s : 0); x <= kTileCells; x += 2 * s) {
        const double error = static_cast<double>(measuredBelow(index, nodeLevel, {x, y}, k - kNodeGrid.k));
        int largest = scale_.codeFromError(error + maxErrorMeters_);
        const int reach = quads ? s : s / 2;
        const std::array<LatticePoint, 4> steps =
            quads ? std::array<LatticePoint, 4>{{{0, -reach}, {reach, 0}, {0, reach}, {-reach, 0}}}
                  : std::array<LatticePoint, 4>{
                        {{-reach, -reach}, {reach, -reach}, {reach, reach}, {-reach, reach}}};
        for (const LatticePoint step : steps) {
          largest = std::max(largest, childCode(index, k, nodeLevel, {x + step.x, y + step.y}) + 1);
        }
        if (largest > 255)
          return makeError("an error code exceeds 255; errorUnit {} m is too small", scale_.errorUnit);
        code(level_, index, k, nodeLevel, {x, y}) = static_cast<uint8_t>(largest);
      }
    }
    return {};
  }

  /// The code of a child at a point in this tile's cells; -1 where no stored tile holds it.
  int childCode(size_t index, int k, int nodeLevel, LatticePoint p) const {
    if (p.x < 0 || p.y < 0 || p.x > kTileCells || p.y > kTileCells) return -1;
    if (nodeLevel < lastLargeNodeLevel(k)) return code(level_, index, k, nodeLevel + 1, p);
    if (level_ == pyramid_.finestLevel()) return -1;

    const TileId id = tiles_[index].id;
    const Pyramid::PlacedPoint below =
        pyramid_.findStored(level_ + 1, {2 * (id.col * kTileCells + p.x), 2 * (id.row * kTileCells + p.y)});
    if (below.tile < 0) return -1;
    return code(level_ + 1, static_cast<size_t>(below.tile), k, firstLargeNodeLevel(k, false), below.local);
  }

  void join(int k, size_t index, LatticePoint local, TileId neighbour, LatticePoint localThere) {
    const int other = neighbour.valid() ? pyramid_.find(neighbour) : -1;
    if (other < 0 || !tiles_[static_cast<size_t>(other)].stored) return;
    const int nodeLevel = firstLargeNodeLevel(k, false);
    uint8_t& a = code(level_, index, k, nodeLevel, local);
    uint8_t& b = code(level_, static_cast<size_t>(other), k, nodeLevel, localThere);
    a = b = std::max(a, b);
  }

  Pyramid& pyramid_;
  int level_;
  bool isRoot_;
  const ElevationScale& scale_;
  double maxErrorMeters_;
  const std::vector<PyramidTile>& tiles_;
  LevelNodes& nodes_;
};

}  // namespace

Status saturateLargeNodes(Pyramid& pyramid, const ElevationScale& scale, double maxErrorMeters,
                          const Workers& workers) {
  for (int level = pyramid.finestLevel(); level >= 0; --level) {
    LargeSaturator saturator(pyramid, level, scale, maxErrorMeters);
    const size_t tiles = pyramid.levels[static_cast<size_t>(level)].size();
    const Status done = workers.forEach(static_cast<int64_t>(tiles), [&](int, int64_t i) {
      return saturator.saturateTile(static_cast<size_t>(i));
    });
    TERRANE_TRY(done);
    for (size_t i = 0; i < tiles; ++i) saturator.joinBorders(i);
  }
  return {};
}

}  // namespace terrane
