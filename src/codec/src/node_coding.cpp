#include "node_coding.h"

#include <algorithm>
#include <array>

#include "node_ranges.h"
#include "rans.h"
#include "terrane/base/check.h"
#include "terrane/tiling/lattice.h"

namespace terrane {
namespace {

/// Which differences are spread alike.
enum class NodeClass : uint8_t {
  FinestError,
  CoarserError,
  FinestLargeError,
  FinestRange,
  InnerRange,
  BorderRange
};
constexpr int kNodeClasses = 6;

/// What codes have lately exceeded their expectation by, so that the next one can be expected to as well.
class Drift {
 public:
  int value() const { return (sixteenths_ + 8) >> 4; }
  void follow(int excess) {
    sixteenths_ = isFirst_ ? 16 * excess : sixteenths_ + (16 * excess - sixteenths_) / 4;
    isFirst_ = false;
  }

 private:
  int sixteenths_ = 0;
  bool isFirst_ = true;
};

int16_t rangeDifference(uint16_t expected, uint16_t code) {
  return static_cast<int16_t>(static_cast<uint16_t>(code - expected));
}

/// Walks all codes in the payload's order and hands each on with what is expected of it: the ranges, then the
/// errors of K = 17 and of each larger K, each from the finest node level up.
class NodeWalk {
 public:
  NodeWalk(const Tile& tile, TileNodes& nodes, const ElevationScale& scale, bool isRoot)
      : nodes_(nodes),
        isRoot_(isRoot),
        ranges_(tile, nodes, scale, isRoot),
        leastError_(scale.codeFromError(scale.sampleError)) {}

  /// visit(class, expected, code): `code` is read or set before the next one is expected.
  template <class VisitError, class VisitRange>
  void walk(VisitError&& visitError, VisitRange&& visitRange) {
    for (int level = kNodeLevels - 1; level >= firstNodeLevel(isRoot_); --level) {
      const bool isFinest = level == kNodeLevels - 1;
      visitPlaces(level, [&](int x, int y) {
        const auto i = static_cast<size_t>(nodeIndex(level, x, y, isRoot_));
        const bool isBorder = x == 0 || y == 0 || x == kTileCells || y == kTileCells;
        const NodeClass of = isFinest   ? NodeClass::FinestRange
                             : isBorder ? NodeClass::BorderRange
                                        : NodeClass::InnerRange;
        visitRange(of, ranges_.expect({level, x, y}), nodes_.low[i], nodes_.high[i]);
      });
    }
    for (int k = kNodeGrid.k; k <= PatchGrid::kLargest; ++k) {
      const int finest = finestLevel(k);
      for (int level = finest; level >= coarsestLevel(k); --level) {
        // What a level exceeds its expectation by, its neighbours do as well.
        Drift drift;
        visitPlaces(level, [&](int x, int y) {
          uint8_t& code = error(k, level, x, y);
          if (level == finest) {
            const bool isLarge = k > kNodeGrid.k;
            visitError(isLarge ? NodeClass::FinestLargeError : NodeClass::FinestError,
                       isLarge ? std::max(ofSmaller(k, level, x, y), leastError_) : ofNeighbours(level, x, y),
                       code);
          } else if (k == kNodeGrid.k && isVoid(level, x, y)) {
            visitError(NodeClass::CoarserError, 0, code);
          } else {
            const int base = ofParts(k, level, x, y);
            visitError(NodeClass::CoarserError, base + drift.value(), code);
            drift.follow(code - base);
          }
        });
      }
    }
  }

 private:
  int finestLevel(int k) const { return k == kNodeGrid.k ? kNodeLevels - 1 : lastLargeNodeLevel(k); }
  int coarsestLevel(int k) const {
    return k == kNodeGrid.k ? firstNodeLevel(isRoot_) : firstLargeNodeLevel(k, isRoot_);
  }
  uint8_t& error(int k, int level, int x, int y) {
    return k == kNodeGrid.k ? nodes_.error[static_cast<size_t>(nodeIndex(level, x, y, isRoot_))]
                            : nodes_.largeError[static_cast<size_t>(largeNodeIndex(k, level, x, y, isRoot_))];
  }

  /// The diamonds of a node level: quad-centres or edge-centres, row by row.
  template <class Visit>
  void visitPlaces(int level, Visit&& visit) {
    const int s = nodeHalfSize(level);
    const bool quads = level % 2 == 0;
    for (int y = quads ? s : 0; y <= kTileCells; y += quads ? 2 * s : s) {
      for (int x = quads ? s : (y / s % 2 == 0 ? s : 0); x <= kTileCells; x += 2 * s) visit(x, y);
    }
  }

  bool isVoid(int level, int x, int y) const {
    const auto i = static_cast<size_t>(nodeIndex(level, x, y, isRoot_));
    return nodes_.low[i] > nodes_.high[i];
  }

  /// Of a quad-centre of the finest level: what its neighbours to the north and west suggest.
  int ofNeighbours(int level, int x, int y) {
    if (isVoid(level, x, y)) return 0;
    const int step = 2 * nodeHalfSize(level);
    int sum = 0;
    int weights = 0;
    const auto add = [&](int dx, int dy, int weight) {
      const bool isInside = x + dx > 0 && x + dx < kTileCells && y + dy > 0;
      if (!isInside || isVoid(level, x + dx, y + dy)) return;
      sum += weight * error(kNodeGrid.k, level, x + dx, y + dy);
      weights += weight;
    };
    add(-step, 0, 3);
    add(0, -step, 3);
    add(-step, -step, 1);
    add(step, -step, 1);
    return weights > 0 ? (sum + weights / 2) / weights : leastError_;
  }
  /// Errors are strictly saturated, and a larger patch is four of the next smaller K.
  int ofParts(int k, int level, int x, int y) {
    int most = 0;
    for (const Diamond& child : Lattice(0).children({x, y, level}))
      most = std::max<int>(most, error(k, child.level, static_cast<int>(child.x), static_cast<int>(child.y)));
    most += most > 0 ? 1 : 0;
    if (k > kNodeGrid.k) most = std::max(most, ofSmaller(k, level, x, y));
    return std::min(most, 255);
  }
  int ofSmaller(int k, int level, int x, int y) {
    const int half = nodeHalfSize(level) / 2;
    const auto at = [&](int dx, int dy) {
      const bool isInside = x + dx >= 0 && x + dx <= kTileCells && y + dy >= 0 && y + dy <= kTileCells;
      return isInside ? int{error(k - 1, level + 2, x + dx, y + dy)} : 0;
    };
    if (level % 2 == 0) {
      return std::max(std::max(at(-half, -half), at(half, -half)), std::max(at(-half, half), at(half, half)));
    }
    return std::max(std::max(at(-half, 0), at(half, 0)), std::max(at(0, -half), at(0, half)));
  }

  TileNodes& nodes_;
  bool isRoot_;
  RangePredictor ranges_;
  int leastError_;
};

}  // namespace

void encodeNodes(const Tile& tile, const ElevationScale& scale, bool isRoot, std::vector<uint8_t>& out) {
  TileNodes nodes = tile.nodes;
  std::array<std::vector<int32_t>, kNodeClasses> differences;
  std::vector<std::pair<NodeClass, int32_t>> sequence;
  const auto add = [&](NodeClass of, int32_t difference) {
    differences[static_cast<size_t>(of)].push_back(difference);
    sequence.emplace_back(of, difference);
  };
  NodeWalk(tile, nodes, scale, isRoot)
      .walk([&](NodeClass of, int expected, uint8_t code) { add(of, code - expected); },
            [&](NodeClass of, RangePredictor::Range expected, uint16_t low, uint16_t high) {
              TERRANE_CHECK(isRange(low, high), "a node's range {} {}", low, high);
              add(of, rangeDifference(expected.low, low));
              add(of, rangeDifference(expected.high, high));
            });

  SegmentWriter writer;
  std::array<int, kNodeClasses> spreads{};
  for (size_t i = 0; i < kNodeClasses; ++i) {
    spreads[i] = bestSpread(differences[i]);
    writer.plain(static_cast<uint32_t>(spreads[i]), 7);
  }
  for (const auto& [of, difference] : sequence) writer.number(spreads[static_cast<size_t>(of)], difference);
  writer.finish(out);
}

Result<size_t> decodeNodes(std::span<const uint8_t> bytes, const ElevationScale& scale, bool isRoot,
                           Tile& tile) {
  size_t used = 0;
  TERRANE_ASSIGN(SegmentReader in, SegmentReader::open(bytes, used));
  TileNodes& nodes = tile.nodes;
  nodes.error.resize(static_cast<size_t>(tileNodeCount(isRoot)));
  nodes.largeError.resize(static_cast<size_t>(tileLargeNodeCount(isRoot)));
  nodes.low.resize(nodes.error.size());
  nodes.high.resize(nodes.error.size());

  std::array<int, kNodeClasses> spreads{};
  bool ok = true;
  for (int& spread : spreads) {
    spread = static_cast<int>(in.plain(7));
    ok &= spread < kSpreads;
    spread = std::min(spread, kSpreads - 1);
  }
  bool isOrdered = true;
  NodeWalk(tile, nodes, scale, isRoot)
      .walk(
          [&](NodeClass of, int expected, uint8_t& code) {
            const int64_t value = int64_t{expected} + in.number(spreads[static_cast<size_t>(of)]);
            ok &= value >= 0 && value <= 255;
            code = static_cast<uint8_t>(value);
          },
          [&](NodeClass of, RangePredictor::Range expected, uint16_t& low, uint16_t& high) {
            const int spread = spreads[static_cast<size_t>(of)];
            const int32_t below = in.number(spread);
            const int32_t above = in.number(spread);
            ok &= below == static_cast<int16_t>(below) && above == static_cast<int16_t>(above);
            low = static_cast<uint16_t>(static_cast<uint32_t>(expected.low) + static_cast<uint32_t>(below));
            high = static_cast<uint16_t>(static_cast<uint32_t>(expected.high) + static_cast<uint32_t>(above));
            isOrdered &= isRange(low, high);
          });
  if (!ok || !in.finish()) return makeError("byte 0: the node codes are damaged");
  if (!isOrdered) return makeError("byte 0: a node has its low above its high");
  return used;
}

}  // namespace terrane
