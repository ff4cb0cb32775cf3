#include "node_coding.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>

#include "node_ranges.h"
#include "binary_coding.h"
#include "terrane/base/check.h"
#include "terrane/tiling/lattice.h"

namespace terrane {
namespace {

/// Which differences are alike.
enum class NodeClass : uint8_t { Finest, Inner, Border, LargeFinest, LargeInner, LargeBorder, Empty };
constexpr size_t kNodeClasses = 7;

/// How large a difference was, for contexts.
constexpr size_t sizeClass(int size) {
  return size < 3 ? static_cast<size_t>(size) : size < 6 ? 3 : 4;
}
constexpr size_t kSizeClasses = 5;

/// A number near 0, by answers: is it, its sign, and how far it goes.
struct NumberModels {
  static constexpr uint32_t kSteps = 14;
  AnswerModel isZero;
  AnswerModel isNegative;
  std::array<AnswerModel, kSteps> goesOn;

  template <class Coder>
  int32_t code(Coder& coder, int32_t value) {
    constexpr int kMost = 60;
    const auto ask = [&](AnswerModel& model, bool yes) {
      yes = coder.code(model.chance, yes);
      model.learn(yes, kMost);
      return yes;
    };
    if (ask(isZero, value == 0)) return 0;
    const bool negative = ask(isNegative, value < 0);
    const auto size = static_cast<uint32_t>(negative ? -value : value);
    uint32_t i = 0;
    while (i < kSteps && ask(goesOn[i], size > i + 1)) ++i;
    uint32_t out = i + 1;
    if (i == kSteps) out += codeLarge(coder, size - out);
    return negative ? -static_cast<int32_t>(out) : static_cast<int32_t>(out);
  }
};

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

  /// visitError(class, context, expected, code), visitRange(context, expected, low, high): codes are read or set
  /// before the next one is expected.
  template <class VisitError, class VisitRange>
  void walk(VisitError&& visitError, VisitRange&& visitRange) {
    for (int level = kNodeLevels - 1; level >= firstNodeLevel(isRoot_); --level) {
      const bool isFinest = level == kNodeLevels - 1;
      visitPlaces(level, [&](int x, int y) {
        const auto i = static_cast<size_t>(nodeIndex(level, x, y, isRoot_));
        const bool isBorder = x == 0 || y == 0 || x == kTileCells || y == kTileCells;
        const NodeClass of = isFinest ? NodeClass::Finest : isBorder ? NodeClass::Border : NodeClass::Inner;
        visitRange(isFinest && !ranges_.isRefined({level, x, y}) ? NodeClass::LargeFinest : of, ranges_.expect({level, x, y}), nodes_.low[i], nodes_.high[i]);
      });
    }
    for (int k = kNodeGrid.k; k <= PatchGrid::kLargest; ++k) {
      const int finest = finestLevel(k);
      for (int level = finest; level >= coarsestLevel(k); --level) {
        // What a level exceeds its expectation by, its neighbours do as well.
        Drift drift;
        visitPlaces(level, [&](int x, int y) {
          uint8_t& code = error(k, level, x, y);
          const bool isLarge = k > kNodeGrid.k;
          if (!isLarge && isVoid(level, x, y)) {
            visitError(NodeClass::Empty, 0, code);
          } else if (level == finest) {
            visitError(isLarge ? NodeClass::LargeFinest : NodeClass::Finest,
                       isLarge ? std::max(ofSmaller(k, level, x, y), leastError_) : ofNeighbours(level, x, y),
                       code);
          } else {
            const int base = ofParts(k, level, x, y);
            const bool isBorder = x == 0 || y == 0 || x == kTileCells || y == kTileCells;
            visitError(isLarge ? (isBorder ? NodeClass::LargeBorder : NodeClass::LargeInner) : isBorder ? NodeClass::Border : NodeClass::Inner,
                       base + drift.value(), code);
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

struct NodeModels {
  std::array<std::array<NumberModels, kSizeClasses>, kNodeClasses> errors;
  std::array<std::array<std::array<NumberModels, kSizeClasses>, 2>, kNodeClasses> ranges;
  std::array<int, kNodeClasses> lastError{};
  std::array<std::array<int, 2>, kNodeClasses> lastRange{};

  template <class Coder>
  int32_t error(Coder& coder, NodeClass of, int32_t value) {
    int& last = lastError[static_cast<size_t>(of)];
    value = errors[static_cast<size_t>(of)][sizeClass(std::min(last, 8))].code(coder, value);
    last = (last + 2 * std::min(std::abs(value), 100) + 1) / 2;
    return value;
  }
  template <class Coder>
  int32_t range(Coder& coder, NodeClass of, size_t side, int32_t value) {
    int& last = lastRange[static_cast<size_t>(of)][side];
    value = ranges[static_cast<size_t>(of)][side][sizeClass(std::min(last, 8))].code(coder, value);
    last = (last + 2 * std::min(std::abs(value), 100) + 1) / 2;
    return value;
  }
};

}  // namespace

void encodeNodes(const Tile& tile, const ElevationScale& scale, bool isRoot, std::vector<uint8_t>& out) {
  TileNodes nodes = tile.nodes;
  BinaryWriter writer;
  NodeModels models;
  NodeWalk(tile, nodes, scale, isRoot)
      .walk([&](NodeClass of, int expected, uint8_t code) { models.error(writer, of, code - expected); },
            [&](NodeClass of, RangePredictor::Range expected, uint16_t low, uint16_t high) {
              TERRANE_CHECK(isRange(low, high), "a node's range {} {}", low, high);
              models.range(writer, of, 0, rangeDifference(expected.low, low));
              models.range(writer, of, 1, rangeDifference(expected.high, high));
            });
  writer.finish(out);
}

Result<size_t> decodeNodes(std::span<const uint8_t> bytes, const ElevationScale& scale, bool isRoot,
                           Tile& tile) {
  size_t used = 0;
  TERRANE_ASSIGN(BinaryReader in, BinaryReader::open(bytes, used));
  TileNodes& nodes = tile.nodes;
  nodes.error.resize(static_cast<size_t>(tileNodeCount(isRoot)));
  nodes.largeError.resize(static_cast<size_t>(tileLargeNodeCount(isRoot)));
  nodes.low.resize(nodes.error.size());
  nodes.high.resize(nodes.error.size());

  bool ok = true;
  bool isOrdered = true;
  NodeModels models;
  NodeWalk(tile, nodes, scale, isRoot)
      .walk(
          [&](NodeClass of, int expected, uint8_t& code) {
            const int64_t value = int64_t{expected} + models.error(in, of, 0);
            ok &= value >= 0 && value <= 255;
            code = static_cast<uint8_t>(value);
          },
          [&](NodeClass of, RangePredictor::Range expected, uint16_t& low, uint16_t& high) {
            const int32_t below = models.range(in, of, 0, 0);
            const int32_t above = models.range(in, of, 1, 0);
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
