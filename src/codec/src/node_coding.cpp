#include "node_coding.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>

#include "binary_coding.h"
#include "node_ranges.h"
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
  TERRANE_INLINE int32_t code(Coder& coder, int32_t value) {
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

/// What the code of a node is expected from: places in the tile's arrays, -1 where there is none.
struct NodeStep {
  NodePlace place;
  NodeClass of = NodeClass::Finest;
  bool isFinest = false;
  bool startsLevel = false;
  int16_t index = 0;
  std::array<int16_t, 4> children{-1, -1, -1, -1};    ///< of the same K
  std::array<int16_t, 4> smaller{-1, -1, -1, -1};     ///< the four patches of the next smaller K
  std::array<int16_t, 4> neighbours{-1, -1, -1, -1};  ///< west, north, north-west, north-east
};

/// All nodes in the payload's order, for each K: from the finest level up, row by row.
class NodePlan {
 public:
  explicit NodePlan(bool isRoot) : isRoot_(isRoot) {
    for (int k = kNodeGrid.k; k <= PatchGrid::kLargest; ++k) {
      const bool isLarge = k > kNodeGrid.k;
      const int finest = isLarge ? lastLargeNodeLevel(k) : kNodeLevels - 1;
      const int coarsest = isLarge ? firstLargeNodeLevel(k, isRoot) : firstNodeLevel(isRoot);
      for (int level = finest; level >= coarsest; --level) addLevel(k, level, level == finest);
    }
  }
  const std::vector<NodeStep>& of(int k) const { return steps_[static_cast<size_t>(k - kNodeGrid.k)]; }

  static const NodePlan& get(bool isRoot) {
    static const NodePlan root(true);
    static const NodePlan other(false);
    return isRoot ? root : other;
  }

 private:
  int16_t indexOf(int k, int level, int x, int y) const {
    if (x < 0 || y < 0 || x > kTileCells || y > kTileCells) return -1;
    return static_cast<int16_t>(k == kNodeGrid.k ? nodeIndex(level, x, y, isRoot_)
                                                 : largeNodeIndex(k, level, x, y, isRoot_));
  }

  void addLevel(int k, int level, bool isFinest) {
    const int s = nodeHalfSize(level);
    const bool quads = level % 2 == 0;
    bool isFirst = true;
    for (int y = quads ? s : 0; y <= kTileCells; y += quads ? 2 * s : s) {
      for (int x = quads ? s : (y / s % 2 == 0 ? s : 0); x <= kTileCells; x += 2 * s) {
        NodeStep step;
        step.place = {level, x, y};
        step.isFinest = isFinest;
        step.startsLevel = isFirst;
        step.index = indexOf(k, level, x, y);
        const bool isBorder = x == 0 || y == 0 || x == kTileCells || y == kTileCells;
        const bool isLarge = k > kNodeGrid.k;
        step.of = isFinest   ? (isLarge ? NodeClass::LargeFinest : NodeClass::Finest)
                  : isBorder ? (isLarge ? NodeClass::LargeBorder : NodeClass::Border)
                             : (isLarge ? NodeClass::LargeInner : NodeClass::Inner);
        if (!isFinest) addChildren(k, step);
        if (isLarge) addSmaller(k, step);
        if (isFinest && !isLarge) addNeighbours(k, step);
        steps_[static_cast<size_t>(k - kNodeGrid.k)].push_back(step);
        isFirst = false;
      }
    }
  }
  void addChildren(int k, NodeStep& step) const {
    size_t count = 0;
    for (const Diamond& child : Lattice(0).children({step.place.x, step.place.y, step.place.nodeLevel}))
      step.children[count++] = indexOf(k, child.level, static_cast<int>(child.x), static_cast<int>(child.y));
  }
  void addSmaller(int k, NodeStep& step) const {
    const NodePlace& place = step.place;
    const int half = nodeHalfSize(place.nodeLevel) / 2;
    const auto at = [&](int dx, int dy) {
      return indexOf(k - 1, place.nodeLevel + 2, place.x + dx, place.y + dy);
    };
    if (place.nodeLevel % 2 == 0) {
      step.smaller = {at(-half, -half), at(half, -half), at(-half, half), at(half, half)};
    } else {
      step.smaller = {at(-half, 0), at(half, 0), at(0, -half), at(0, half)};
    }
  }
  void addNeighbours(int k, NodeStep& step) const {
    const auto [level, x, y] = step.place;
    const int far = 2 * nodeHalfSize(level);
    step.neighbours = {indexOf(k, level, x - far, y), indexOf(k, level, x, y - far),
                       indexOf(k, level, x - far, y - far), -1};
    if (x + far < kTileCells) step.neighbours[3] = indexOf(k, level, x + far, y - far);
  }

  bool isRoot_;
  std::array<std::vector<NodeStep>, PatchGrid::kLargest - kNodeGrid.k + 1> steps_;
};

/// Walks all codes in the payload's order and hands each on with what is expected of it: the ranges, then the
/// errors of K = 17 and of each larger K, each from the finest node level up.
class NodeWalk {
 public:
  NodeWalk(const Tile& tile, TileNodes& nodes, const ElevationScale& scale, bool isRoot)
      : nodes_(nodes),
        plan_(NodePlan::get(isRoot)),
        ranges_(tile, nodes, scale),
        leastError_(scale.codeFromError(scale.sampleError)) {}

  /// visitError(class, expected, code), visitRange(class, expected, low, high): codes are read or set before
  /// the next one is expected.
  template <class VisitError, class VisitRange>
  void walk(VisitError&& visitError, VisitRange&& visitRange) {
    for (const NodeStep& step : plan_.of(kNodeGrid.k)) {
      const auto i = static_cast<size_t>(step.index);
      // Where no finer tile is, the samples say it all.
      const bool isExact = step.isFinest && !ranges_.isRefined(step.place);
      const auto expected = step.isFinest ? ranges_.ofSamples(step.place) : ranges_.ofChildren(step.children);
      visitRange(isExact ? NodeClass::LargeFinest : step.of, expected, nodes_.low[i], nodes_.high[i]);
    }
    for (int k = kNodeGrid.k; k <= PatchGrid::kLargest; ++k) {
      std::vector<uint8_t>& codes = k == kNodeGrid.k ? nodes_.error : nodes_.largeError;
      const std::vector<uint8_t>& smaller = k <= kNodeGrid.k + 1 ? nodes_.error : nodes_.largeError;
      // What a level exceeds its expectation by, its neighbours do as well.
      Drift drift;
      for (const NodeStep& step : plan_.of(k)) {
        if (step.startsLevel) drift = Drift();
        uint8_t& code = codes[static_cast<size_t>(step.index)];
        if (k == kNodeGrid.k && isVoid(step.index)) {
          visitError(NodeClass::Empty, 0, code);
        } else if (step.isFinest) {
          visitError(
              step.of,
              k == kNodeGrid.k ? ofNeighbours(step) : std::max(largestOf(step.smaller, smaller), leastError_),
              code);
        } else {
          // Errors are strictly saturated, and a larger patch is four of the next smaller K.
          int base = largestOf(step.children, codes);
          base += base > 0 ? 1 : 0;
          if (k > kNodeGrid.k) base = std::max(base, largestOf(step.smaller, smaller));
          base = std::min(base, 255);
          visitError(step.of, base + drift.value(), code);
          drift.follow(code - base);
        }
      }
    }
  }

 private:
  bool isVoid(int16_t index) const {
    return nodes_.low[static_cast<size_t>(index)] > nodes_.high[static_cast<size_t>(index)];
  }
  static int largestOf(const std::array<int16_t, 4>& places, const std::vector<uint8_t>& codes) {
    int most = 0;
    for (const int16_t place : places) {
      if (place >= 0) most = std::max<int>(most, codes[static_cast<size_t>(place)]);
    }
    return most;
  }
  /// Of a quad-centre of the finest level: what its neighbours to the north and west suggest.
  int ofNeighbours(const NodeStep& step) const {
    static constexpr std::array<int, 4> kWeights = {3, 3, 1, 1};
    int sum = 0;
    int weights = 0;
    for (size_t i = 0; i < 4; ++i) {
      const int16_t place = step.neighbours[i];
      if (place < 0 || isVoid(place)) continue;
      sum += kWeights[i] * nodes_.error[static_cast<size_t>(place)];
      weights += kWeights[i];
    }
    return weights > 0 ? (sum + weights / 2) / weights : leastError_;
  }

  TileNodes& nodes_;
  const NodePlan& plan_;
  RangePredictor ranges_;
  int leastError_;
};

struct NodeModels {
  std::array<std::array<NumberModels, kSizeClasses>, kNodeClasses> errors;
  std::array<std::array<std::array<NumberModels, kSizeClasses>, 2>, kNodeClasses> ranges;
  std::array<int, kNodeClasses> lastError{};
  std::array<std::array<int, 2>, kNodeClasses> lastRange{};

  template <class Coder>
  TERRANE_INLINE int32_t error(Coder& coder, NodeClass of, int32_t value) {
    int& last = lastError[static_cast<size_t>(of)];
    value = errors[static_cast<size_t>(of)][sizeClass(std::min(last, 8))].code(coder, value);
    last = (last + 2 * std::min(std::abs(value), 100) + 1) / 2;
    return value;
  }
  template <class Coder>
  TERRANE_INLINE int32_t range(Coder& coder, NodeClass of, size_t side, int32_t value) {
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
