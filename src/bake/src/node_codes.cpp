#include <algorithm>

#include "node_measure.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {

namespace {

/// A node's codes in the making; wide enough to see an overflow.
struct Codes {
  int error = 0;
  uint16_t low = 65535;
  uint16_t high = 0;

  void includeChild(int childError, uint16_t childLow, uint16_t childHigh) {
    error = std::max(error, childError + 1);
    low = std::min(low, childLow);
    high = std::max(high, childHigh);
  }
};

/// Saturates one level whose children's level is done.
class LevelSaturator {
 public:
  LevelSaturator(Pyramid& pyramid, int level, const ElevationScale& scale, double maxErrorMeters)
      : pyramid_(pyramid),
        level_(level),
        isRoot_(level == 0),
        scale_(scale),
        maxErrorMeters_(maxErrorMeters),
        tiles_(pyramid.levels[static_cast<size_t>(level)]),
        nodes_(pyramid.nodes[static_cast<size_t>(level)]) {
    nodes_.errorCode.assign(nodes_.error.size(), 0);
    nodes_.lowCode.assign(nodes_.error.size(), 65535);
    nodes_.highCode.assign(nodes_.error.size(), 0);
  }

  /// Quad-centres with their children in the level below, then edge-centres with the quads of this tile.
  Status saturateTile(size_t index) {
    if (!tiles_[index].stored) return {};
    const size_t first = index * static_cast<size_t>(nodes_.nodesPerTile);
    const TileId id = tiles_[index].id;
    for (int node = nodeOffset(8, isRoot_); node < nodes_.nodesPerTile; ++node) {
      const NodePlace place = nodePlace(node, isRoot_);
      Codes codes = ownRange(first + static_cast<size_t>(node));
      includeEdgesBelow(id, index, place, codes);
      TERRANE_TRY(setOwn(first + static_cast<size_t>(node), codes));
    }
    for (int nodeLevel = 7; nodeLevel >= firstNodeLevel(isRoot_); --nodeLevel) {
      TERRANE_TRY(saturateNodeLevel(first, nodeLevel));
    }
    return {};
  }

  /// Edge-centres between two tiles get the same codes in both.
  void joinBorders(size_t index) {
    if (!tiles_[index].stored) return;
    const TileId id = tiles_[index].id;
    const int s = nodeHalfSize(7);
    const int east = storedTile({id.level, id.col + 1, id.row});
    const int south = storedTile({id.level, id.col, id.row + 1});
    for (int at = s; at < kTileCells; at += 2 * s) {
      if (east >= 0) join(index, kTileCells, at, static_cast<size_t>(east), 0, at);
      if (south >= 0) join(index, at, kTileCells, static_cast<size_t>(south), at, 0);
    }
  }

 private:
  int storedTile(TileId id) const {
    if (!id.valid()) return -1;
    const int index = pyramid_.find(id);
    return index >= 0 && tiles_[static_cast<size_t>(index)].stored ? index : -1;
  }

  /// The range that was measured under a quad.
  Codes ownRange(size_t node) const {
    Codes codes;
    if (nodes_.low[node] <= nodes_.high[node]) {
      codes.low = scale_.lowCode(static_cast<double>(nodes_.low[node]) - maxErrorMeters_);
      codes.high = scale_.highCode(static_cast<double>(nodes_.high[node]) + maxErrorMeters_);
    }
    return codes;
  }

  /// Adds the node's own error, unless there is no ground under it, and stores the codes.
  Status setOwn(size_t node, Codes codes) {
    if (codes.low <= codes.high) {
      const double error = static_cast<double>(nodes_.error[node]) + maxErrorMeters_;
      codes.error = std::max(codes.error, static_cast<int>(scale_.codeFromError(error)));
    }
    if (codes.error > 255)
      return makeError("an error code exceeds 255; errorUnit {} m is too small", scale_.errorUnit);
    nodes_.errorCode[node] = static_cast<uint8_t>(codes.error);
    nodes_.lowCode[node] = codes.low;
    nodes_.highCode[node] = codes.high;
    return {};
  }

  void includeEdgesBelow(TileId id, size_t index, NodePlace place, Codes& codes) const {
    if (level_ == pyramid_.finestLevel()) return;
    const int quadrant = (place.x >= kTileCells / 2 ? 1 : 0) + (place.y >= kTileCells / 2 ? 2 : 0);
    const int32_t child = tiles_[index].children[static_cast<size_t>(quadrant)];
    const bool childStored =
        child >= 0 && pyramid_.levels[static_cast<size_t>(level_) + 1][static_cast<size_t>(child)].stored;
    const LatticePoint center{2 * (id.col * kTileCells + place.x), 2 * (id.row * kTileCells + place.y)};
    const int reach = nodeHalfSize(7);
    for (const LatticePoint step : {LatticePoint{0, -reach}, {reach, 0}, {0, reach}, {-reach, 0}}) {
      const LatticePoint edge{center.x + step.x, center.y + step.y};
      if (childStored) {
        const LevelNodes& below = pyramid_.nodes[static_cast<size_t>(level_) + 1];
        const TileId childId = id.child(quadrant);
        const size_t node = static_cast<size_t>(child) * static_cast<size_t>(below.nodesPerTile) +
                            static_cast<size_t>(nodeIndex(7, edge.x - childId.col * kTileCells,
                                                          edge.y - childId.row * kTileCells, false));
        codes.includeChild(below.errorCode[node], below.lowCode[node], below.highCode[node]);
      } else if (edge.x % kTileCells == 0 || edge.y % kTileCells == 0) {
        const NodeCodes other = nodeCodesAt(pyramid_, level_ + 1, 7, edge);
        if (other.error >= 0) codes.includeChild(other.error, other.low, other.high);
      }
    }
  }

  /// A node level whose children are in the same tile.
  Status saturateNodeLevel(size_t first, int nodeLevel) {
    const int s = nodeHalfSize(nodeLevel);
    const int offset = nodeOffset(nodeLevel, isRoot_);
    for (int node = offset; node < offset + nodeCount(nodeLevel); ++node) {
      const NodePlace place = nodePlace(node, isRoot_);
      Codes codes;
      const auto include = [&](int x, int y) {
        if (x < 0 || y < 0 || x > kTileCells || y > kTileCells) return;
        const size_t child = first + static_cast<size_t>(nodeIndex(nodeLevel + 1, x, y, isRoot_));
        codes.includeChild(nodes_.errorCode[child], nodes_.lowCode[child], nodes_.highCode[child]);
      };
      if (nodeLevel % 2 == 0) {
        include(place.x, place.y - s);
        include(place.x + s, place.y);
        include(place.x, place.y + s);
        include(place.x - s, place.y);
      } else {
        for (const int dx : {-s / 2, s / 2}) {
          for (const int dy : {-s / 2, s / 2}) include(place.x + dx, place.y + dy);
        }
      }
      TERRANE_TRY(setOwn(first + static_cast<size_t>(node), codes));
    }
    return {};
  }

  void join(size_t a, int ax, int ay, size_t b, int bx, int by) {
    const auto nodeOf = [&](size_t tile, int x, int y) {
      return tile * static_cast<size_t>(nodes_.nodesPerTile) +
             static_cast<size_t>(nodeIndex(7, x, y, isRoot_));
    };
    const size_t i = nodeOf(a, ax, ay);
    const size_t j = nodeOf(b, bx, by);
    nodes_.errorCode[i] = nodes_.errorCode[j] = std::max(nodes_.errorCode[i], nodes_.errorCode[j]);
    nodes_.lowCode[i] = nodes_.lowCode[j] = std::min(nodes_.lowCode[i], nodes_.lowCode[j]);
    nodes_.highCode[i] = nodes_.highCode[j] = std::max(nodes_.highCode[i], nodes_.highCode[j]);
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

Status saturateNodes(Pyramid& pyramid, const ElevationScale& scale, double maxErrorMeters,
                     const Workers& workers) {
  for (int level = pyramid.finestLevel(); level >= 0; --level) {
    LevelSaturator saturator(pyramid, level, scale, maxErrorMeters);
    const size_t tiles = pyramid.levels[static_cast<size_t>(level)].size();
    const Status done = workers.forEach(static_cast<int64_t>(tiles), [&](int, int64_t i) {
      return saturator.saturateTile(static_cast<size_t>(i));
    });
    TERRANE_TRY(done);
    for (size_t i = 0; i < tiles; ++i) saturator.joinBorders(i);
  }
  return {};
}

NodeCodes nodeCodesAt(const Pyramid& pyramid, int level, int nodeLevel, LatticePoint center) {
  const Pyramid::PlacedPoint at = pyramid.findStored(level, center);
  if (at.tile < 0) return {};
  const LevelNodes& nodes = pyramid.nodes[static_cast<size_t>(level)];
  const size_t node = static_cast<size_t>(at.tile) * static_cast<size_t>(nodes.nodesPerTile) +
                      static_cast<size_t>(nodeIndex(nodeLevel, at.local.x, at.local.y, level == 0));
  return {nodes.errorCode[node], nodes.lowCode[node], nodes.highCode[node]};
}

ChildSummary summariseMissingChild(const TileSamples& samples, const TileNodes& nodes, bool isRoot,
                                   int quadrant) {
  constexpr int kHalf = kTileCells / 2;
  const int firstX = (quadrant & 1) * kHalf;
  const int firstY = (quadrant >> 1) * kHalf;

  // Ground in it, be it a sample without a cell?
  bool ground = false;
  for (int y = firstY; y <= firstY + kHalf && !ground; ++y) {
    for (int x = firstX; x <= firstX + kHalf; ++x) {
      ground |= samples.states[static_cast<size_t>(y * kTileSamples + x)] != SampleState::Void;
    }
  }
  ChildSummary summary;
  if (!ground) return summary;

  summary.state = ChildState::Interpolated;
  const int s = nodeHalfSize(8);
  for (int y = firstY + s; y < firstY + kHalf; y += 2 * s) {
    for (int x = firstX + s; x < firstX + kHalf; x += 2 * s) {
      const auto node = static_cast<size_t>(nodeIndex(8, x, y, isRoot));
      summary.low = std::min(summary.low, nodes.low[node]);
      summary.high = std::max(summary.high, nodes.high[node]);
    }
  }
  return summary;
}

}  // namespace terrane
