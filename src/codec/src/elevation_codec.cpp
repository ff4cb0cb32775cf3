#include "terrane/codec/elevation_codec.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "byte_streams.h"
#include "node_ranges.h"
#include "parent_samples.h"
#include "sample_lattice.h"
#include "terrane/base/check.h"

// docs/format/elevation-v1.md specifies every byte that is written and read here.
namespace terrane {
namespace {

constexpr uint8_t kVersion = 1;
constexpr uint8_t kFlagRoot = 1;

/// What one byte says of all of a tile's own samples.
enum class StatesMode : uint8_t { AllVoid = 0, AllInterpolated = 1, AllCoded = 2, Explicit = 3 };
enum class CoverageMode : uint8_t { None = 0, Full = 1, FromCorners = 2, Bitmap = 3 };

/// Step numbers stay exact in a float.
constexpr int32_t kLargestInteger = (1 << 24) - 1;

constexpr std::array<int, 4> kCorners = {0, kTileCells, kTileCells* kTileSamples, kTileSampleCount - 1};

/// The half-size of the coarsest samples that a tile holds itself.
constexpr int coarsestHalfSize(bool isRoot) {
  return isRoot ? kCoarsestHalfSize : 1;
}

/// How many samples of each kind a tile holds itself, corners aside.
struct OwnCounts {
  size_t quadCenters = 0;
  size_t edgeCenters = 0;
};
OwnCounts ownCounts(bool isRoot) {
  OwnCounts counts;
  for (int s = coarsestHalfSize(isRoot); s >= 1; s /= 2) {
    counts.quadCenters += static_cast<size_t>(quadCenterCount(s));
    counts.edgeCenters += static_cast<size_t>(edgeCenterCount(s));
  }
  return counts;
}

/// Predicts step numbers from known heights. Everything is IEEE double arithmetic in a fixed order, so that
/// every machine predicts the same.
class Predictor {
 public:
  explicit Predictor(const ElevationScale& scale)
      : offset_(scale.heightOffset), stepsPerMeter_(1.0 / scale.heightStep) {}

  int32_t operator()(float endA, float endB, float apexA, float apexB) const {
    const double sum = (static_cast<double>(endA) + static_cast<double>(endB)) +
                       (static_cast<double>(apexA) + static_cast<double>(apexB));
    const double steps = (sum * 0.25 - offset_) * stepsPerMeter_;
    // note: clamped and made positive before the cast, which is then the floor and never out of range.
    return static_cast<int32_t>(std::min(std::max(steps, -kLimit), kLimit) + (kLimit + 0.5)) -
           static_cast<int32_t>(kLimit);
  }

 private:
  static constexpr double kLimit = 1 << 25;
  double offset_;
  double stepsPerMeter_;
};

/// Which cells have four corners that are ground.
std::vector<uint8_t> coverageFromCorners(const std::vector<SampleState>& states) {
  std::vector<uint8_t> bits(Coverage::kBytes, 0);
  for (int row = 0; row < kTileCells; ++row) {
    const SampleState* north = states.data() + row * kTileSamples;
    const SampleState* south = north + kTileSamples;
    for (int col = 0; col < kTileCells; ++col) {
      const bool ground = std::min(std::min(north[col], north[col + 1]),
                                   std::min(south[col], south[col + 1])) != SampleState::Void;
      const int cell = row * kTileCells + col;
      bits[static_cast<size_t>(cell >> 3)] |= static_cast<uint8_t>((ground ? 1U : 0U) << (cell & 7));
    }
  }
  return bits;
}

// ------------------------------------------------------------------------------------------------ nodes

/// A height range is empty in one way only.
bool isRange(uint16_t low, uint16_t high) {
  return low <= high || (low == 65535 && high == 0);
}

/// A code as a small number where it is near to what is expected; differences are modulo the code's width.
uint32_t differenceTo(uint16_t expected, uint16_t code) {
  return zigzag(static_cast<int16_t>(static_cast<uint16_t>(code - expected))) & 0xffffU;
}
uint32_t differenceTo(uint8_t expected, uint8_t code) {
  return zigzag(static_cast<int8_t>(static_cast<uint8_t>(code - expected))) & 0xffU;
}

/// Calls visit(index, place) for a tile's nodes from the finest level up, which is the payload's order.
template <class Visit>
void visitNodes(bool isRoot, Visit&& visit) {
  for (int level = kNodeLevels - 1; level >= firstNodeLevel(isRoot); --level) {
    const int offset = nodeOffset(level, isRoot);
    for (int i = offset; i < offset + nodeCount(level); ++i)
      visit(static_cast<size_t>(i), nodePlace(i, isRoot));
  }
}

/// Error codes, each as its difference to the one before; height ranges, as their differences to what is
/// expected.
void writeNodes(const Tile& tile, const ElevationScale& scale, bool isRoot, ByteWriter& out) {
  const TileNodes& nodes = tile.nodes;
  std::vector<uint32_t> errors;
  uint8_t last = 0;
  for (const std::vector<uint8_t>* codes : {&nodes.error, &nodes.largeError}) {
    for (const uint8_t code : *codes) {
      errors.push_back(differenceTo(last, code));
      last = code;
    }
  }

  std::vector<uint32_t> lows;
  std::vector<uint32_t> highs;
  const RangePredictor predictor(tile, nodes, scale, isRoot);
  visitNodes(isRoot, [&](size_t i, const NodePlace& place) {
    TERRANE_CHECK(isRange(nodes.low[i], nodes.high[i]), "node {}: range {} {}", i, nodes.low[i],
                  nodes.high[i]);
    const RangePredictor::Range expected = predictor.expect(place);
    lows.push_back(differenceTo(expected.low, nodes.low[i]));
    highs.push_back(differenceTo(expected.high, nodes.high[i]));
  });
  out.column(errors);
  out.column(lows);
  out.column(highs);
}

/// The tile's samples and children must be there.
Status readNodes(ByteReader& in, const ElevationScale& scale, bool isRoot, Tile& tile) {
  TileNodes& nodes = tile.nodes;
  const auto count = static_cast<size_t>(tileNodeCount(isRoot));
  const auto largeCount = static_cast<size_t>(tileLargeNodeCount(isRoot));
  const size_t start = in.offset();
  std::vector<uint32_t> errors(count + largeCount);
  std::vector<uint32_t> lows(count);
  std::vector<uint32_t> highs(count);
  TERRANE_TRY(in.column(errors));
  TERRANE_TRY(in.column(lows));
  TERRANE_TRY(in.column(highs));
  if (*std::max_element(errors.begin(), errors.end()) > 255 ||
      *std::max_element(lows.begin(), lows.end()) > 65535 ||
      *std::max_element(highs.begin(), highs.end()) > 65535) {
    return makeError("byte {}: a node's code is out of range", start);
  }

  nodes.error.resize(count);
  nodes.largeError.resize(largeCount);
  uint8_t last = 0;
  for (size_t i = 0; i < errors.size(); ++i) {
    last = static_cast<uint8_t>(last + unzigzag(errors[i]));
    (i < count ? nodes.error[i] : nodes.largeError[i - count]) = last;
  }

  nodes.low.resize(count);
  nodes.high.resize(count);
  const RangePredictor predictor(tile, nodes, scale, isRoot);
  size_t next = 0;
  std::optional<size_t> wrong;
  visitNodes(isRoot, [&](size_t i, const NodePlace& place) {
    const RangePredictor::Range expected = predictor.expect(place);
    nodes.low[i] = static_cast<uint16_t>(expected.low + unzigzag(lows[next]));
    nodes.high[i] = static_cast<uint16_t>(expected.high + unzigzag(highs[next]));
    if (!isRange(nodes.low[i], nodes.high[i])) wrong = i;
    ++next;
  });
  if (wrong) {
    return makeError("byte {}: node {} has its low {} above its high {}", start, *wrong, nodes.low[*wrong],
                     nodes.high[*wrong]);
  }
  return {};
}

void writeChildren(const std::array<ChildSummary, 4>& children, ByteWriter& out) {
  unsigned states = 0;
  for (size_t i = 0; i < 4; ++i) states |= static_cast<unsigned>(children[i].state) << (2 * i);
  out.byte(static_cast<uint8_t>(states));
  for (const ChildSummary& child : children) {
    TERRANE_CHECK(child.state == ChildState::Present || child.error == 0, "child error {}", child.error);
    TERRANE_CHECK(isRange(child.low, child.high), "child range {} {}", child.low, child.high);
    out.byte(child.error);
    out.uint16(child.low);
    out.uint16(child.high);
  }
}

Status readChildren(ByteReader& in, std::array<ChildSummary, 4>& children) {
  const size_t start = in.offset();
  TERRANE_ASSIGN(const unsigned states, in.byte());
  for (size_t i = 0; i < 4; ++i) {
    const unsigned state = states >> (2 * i) & 3U;
    if (state == 3) return makeError("byte {}: child {} has the unknown state 3", start, i);
    ChildSummary& child = children[i];
    child.state = static_cast<ChildState>(state);
    const size_t childStart = in.offset();
    TERRANE_ASSIGN(child.error, in.byte());
    TERRANE_ASSIGN(child.low, in.uint16());
    TERRANE_ASSIGN(child.high, in.uint16());
    if (child.state != ChildState::Present && child.error != 0) {
      return makeError("byte {}: child {} is not stored and has the error code {}", childStart, i,
                       child.error);
    }
    if (!isRange(child.low, child.high)) {
      return makeError("byte {}: child {} has its low {} above its high {}", childStart, i, child.low,
                       child.high);
    }
  }
  return {};
}

// -------------------------------------------------------------------------------------------- encoding

/// Collects what a tile holds itself, in the payload's order.
class SampleEncoder {
 public:
  SampleEncoder(const TileSamples& samples, const ElevationScale& scale)
      : samples_(samples), scale_(scale), predict_(scale) {}

  void corners() {
    for (const int corner : kCorners) cornerStates.push_back(state(corner));
  }
  void level(int s) {
    visitQuadCenters(s, [&](int center, int endA, int endB, int apexA, int apexB) {
      sample(center, endA, endB, apexA, apexB, quadStates, quadResiduals);
    });
    visitEdgeCenters(s, [&](int center, int endA, int endB, int apexA, int apexB) {
      sample(center, endA, endB, apexA, apexB, edgeStates, edgeResiduals);
    });
  }

  /// The step number whose height a coded sample has.
  int32_t integerAt(int index) const {
    const float height = samples_.heights[static_cast<size_t>(index)];
    const int64_t nearest = scale_.integerFromHeight(static_cast<double>(height));
    // Where a float is coarser than the step, a neighbour's height may be nearer than its own.
    for (const int64_t q : {nearest, nearest - 1, nearest + 1}) {
      if (std::abs(q) <= kLargestInteger && scale_.heightFromInteger(q) == height)
        return static_cast<int32_t>(q);
    }
    TERRANE_CHECK(false, "coded sample {} at {} m is not on the step {} or beyond 2^24 steps", index, height,
                  scale_.heightStep);
  }

  std::vector<SampleState> cornerStates;
  std::vector<SampleState> quadStates;
  std::vector<SampleState> edgeStates;
  std::vector<uint32_t> quadResiduals;
  std::vector<uint32_t> edgeResiduals;

 private:
  SampleState state(int index) const { return samples_.states[static_cast<size_t>(index)]; }

  void sample(int center, int endA, int endB, int apexA, int apexB, std::vector<SampleState>& states,
              std::vector<uint32_t>& residuals) {
    const float* heights = samples_.heights.data();
    states.push_back(state(center));
    if (state(center) == SampleState::Coded) {
      const int32_t predicted = predict_(heights[endA], heights[endB], heights[apexA], heights[apexB]);
      residuals.push_back(zigzag(integerAt(center) - predicted));
    } else {
      const float expected = (heights[endA] + heights[endB]) * 0.5F;
      TERRANE_CHECK(heights[center] == expected, "sample {}: {} m instead of its ends' mean {} m", center,
                    heights[center], expected);
    }
  }

  const TileSamples& samples_;
  const ElevationScale& scale_;
  Predictor predict_;
};

CoverageMode coverageModeOf(const TileSamples& samples) {
  switch (samples.coverage.kind) {
    case Coverage::Kind::None:
      return CoverageMode::None;
    case Coverage::Kind::Full:
      return CoverageMode::Full;
    case Coverage::Kind::Partial:
      break;
  }
  TERRANE_CHECK(samples.coverage.bits.size() == Coverage::kBytes, "{} bytes", samples.coverage.bits.size());
  return samples.coverage.bits == coverageFromCorners(samples.states) ? CoverageMode::FromCorners
                                                                      : CoverageMode::Bitmap;
}

void checkShapes(const Tile& tile, const TileSamples* parent, int quadrant) {
  const size_t nodes = static_cast<size_t>(tileNodeCount(parent == nullptr));
  TERRANE_CHECK(quadrant >= 0 && quadrant < 4, "quadrant {}", quadrant);
  TERRANE_CHECK(tile.samples.heights.size() == kTileSampleCount, "{}", tile.samples.heights.size());
  TERRANE_CHECK(tile.samples.states.size() == kTileSampleCount, "{}", tile.samples.states.size());
  TERRANE_CHECK(tile.nodes.error.size() == nodes, "{} of {}", tile.nodes.error.size(), nodes);
  TERRANE_CHECK(tile.nodes.largeError.size() == static_cast<size_t>(tileLargeNodeCount(parent == nullptr)),
                "{}", tile.nodes.largeError.size());
  TERRANE_CHECK(tile.nodes.low.size() == nodes, "{} of {}", tile.nodes.low.size(), nodes);
  TERRANE_CHECK(tile.nodes.high.size() == nodes, "{} of {}", tile.nodes.high.size(), nodes);
}

/// The samples that both hold must be the same: the decoder takes them from the parent.
void checkParent(const TileSamples& samples, const TileSamples& parent, int quadrant) {
  const int firstX = (quadrant & 1) * (kTileCells / 2);
  const int firstY = (quadrant >> 1) * (kTileCells / 2);
  for (int y = 0; y <= kTileCells / 2; ++y) {
    for (int x = 0; x <= kTileCells / 2; ++x) {
      const size_t own = static_cast<size_t>(2 * y * kTileSamples + 2 * x);
      const size_t parents = static_cast<size_t>((firstY + y) * kTileSamples + firstX + x);
      TERRANE_CHECK(
          samples.heights[own] == parent.heights[parents] && samples.states[own] == parent.states[parents],
          "sample {}, {}: {} m, {} m in the parent", 2 * x, 2 * y, samples.heights[own],
          parent.heights[parents]);
    }
  }
}

// -------------------------------------------------------------------------------------------- decoding

/// States and residuals of one kind of sample, consumed from front to back.
struct SampleStream {
  std::vector<SampleState> states;
  std::vector<uint32_t> residuals;
  size_t nextState = 0;
  size_t nextResidual = 0;
};

/// Turns streams into samples, level by level.
class SampleDecoder {
 public:
  SampleDecoder(TileSamples& samples, const ElevationScale& scale)
      : heights_(samples.heights.data()), states_(samples.states.data()), scale_(scale), predict_(scale) {}

  void level(int s, SampleStream& quads, SampleStream& edges) {
    visitQuadCenters(s, [&](int center, int endA, int endB, int apexA, int apexB) {
      sample(center, endA, endB, apexA, apexB, quads);
    });
    visitEdgeCenters(s, [&](int center, int endA, int endB, int apexA, int apexB) {
      sample(center, endA, endB, apexA, apexB, edges);
    });
  }
  /// Some coded height was beyond the largest step number.
  bool outOfRange() const { return outOfRange_; }

 private:
  void sample(int center, int endA, int endB, int apexA, int apexB, SampleStream& stream) {
    const SampleState state = stream.states[stream.nextState++];
    states_[center] = state;
    if (state != SampleState::Coded) {
      heights_[center] = (heights_[endA] + heights_[endB]) * 0.5F;
      return;
    }
    const int32_t predicted = predict_(heights_[endA], heights_[endB], heights_[apexA], heights_[apexB]);
    const int64_t q = static_cast<int64_t>(predicted) + unzigzag(stream.residuals[stream.nextResidual++]);
    outOfRange_ |= q > kLargestInteger || q < -kLargestInteger;
    heights_[center] = scale_.heightFromInteger(q);
  }

  float* heights_;
  SampleState* states_;
  const ElevationScale& scale_;
  Predictor predict_;
  bool outOfRange_ = false;
};

Status readStates(ByteReader& in, StatesMode mode, std::span<SampleState> states) {
  if (mode != StatesMode::Explicit) {
    std::fill(states.begin(), states.end(), static_cast<SampleState>(mode));
    return {};
  }
  const size_t start = in.offset();
  std::vector<uint8_t> packed((states.size() + 3) / 4);
  TERRANE_TRY(in.section(packed));
  for (size_t i = 0; i < states.size(); ++i) {
    const unsigned state = packed[i / 4] >> (2 * (i % 4)) & 3U;
    if (state == 3) return makeError("byte {}: sample {} has the unknown state 3", start, i);
    states[i] = static_cast<SampleState>(state);
  }
  for (size_t i = states.size(); i < 4 * packed.size(); ++i) {
    if ((packed[i / 4] >> (2 * (i % 4)) & 3U) != 0)
      return makeError("byte {}: state bits after the last", start);
  }
  return {};
}

Status readCorners(ByteReader& in, std::span<const SampleState> states, const ElevationScale& scale,
                   TileSamples& samples) {
  const auto largest = static_cast<float>(std::abs(scale.heightOffset) + kLargestInteger * scale.heightStep);
  for (size_t i = 0; i < kCorners.size(); ++i) {
    const size_t start = in.offset();
    TERRANE_ASSIGN(const uint32_t bits, in.uint32());
    float height = 0.0F;
    if (states[i] == SampleState::Coded) {
      const auto q = static_cast<int32_t>(bits);
      if (q > kLargestInteger || q < -kLargestInteger)
        return makeError("byte {}: corner {} at step {}", start, i, q);
      height = scale.heightFromInteger(q);
    } else {
      height = std::bit_cast<float>(bits);
      // note: written so that NaN fails.
      if (!(std::abs(height) <= largest)) return makeError("byte {}: corner {} at {} m", start, i, height);
    }
    samples.heights[static_cast<size_t>(kCorners[i])] = height;
    samples.states[static_cast<size_t>(kCorners[i])] = states[i];
  }
  return {};
}

Status readCoverage(ByteReader& in, CoverageMode mode, TileSamples& samples) {
  Coverage& coverage = samples.coverage;
  coverage = {};
  switch (mode) {
    case CoverageMode::None:
      return {};
    case CoverageMode::Full:
      coverage.kind = Coverage::Kind::Full;
      return {};
    case CoverageMode::FromCorners:
      coverage.kind = Coverage::Kind::Partial;
      coverage.bits = coverageFromCorners(samples.states);
      return {};
    case CoverageMode::Bitmap:
      break;
  }
  coverage.kind = Coverage::Kind::Partial;
  coverage.bits.resize(Coverage::kBytes);
  return in.section(coverage.bits);
}

Status readResiduals(ByteReader& in, SampleStream& stream) {
  stream.residuals.resize(
      static_cast<size_t>(std::count(stream.states.begin(), stream.states.end(), SampleState::Coded)));
  return in.column(stream.residuals);
}

}  // namespace

std::vector<uint8_t> encodeTile(const Tile& tile, const TileSamples* parent, int quadrant,
                                const ElevationScale& scale) {
  checkShapes(tile, parent, quadrant);
  if (parent != nullptr) checkParent(tile.samples, *parent, quadrant);
  const bool isRoot = parent == nullptr;

  // Walk the lattice as the decoder will.
  SampleEncoder encoder(tile.samples, scale);
  if (isRoot) encoder.corners();
  for (int s = coarsestHalfSize(isRoot); s >= 1; s /= 2) encoder.level(s);

  // Most tiles are of one kind throughout.
  std::vector<SampleState> states = encoder.cornerStates;
  states.insert(states.end(), encoder.quadStates.begin(), encoder.quadStates.end());
  states.insert(states.end(), encoder.edgeStates.begin(), encoder.edgeStates.end());
  const bool isUniform =
      std::all_of(states.begin(), states.end(), [&](SampleState s) { return s == states[0]; });
  const StatesMode statesMode = isUniform ? static_cast<StatesMode>(states[0]) : StatesMode::Explicit;
  const CoverageMode coverageMode = coverageModeOf(tile.samples);

  ByteWriter out;
  out.byte(kVersion);
  out.byte(static_cast<uint8_t>((isRoot ? kFlagRoot : 0) | static_cast<unsigned>(statesMode) << 1 |
                                static_cast<unsigned>(coverageMode) << 3));
  out.byte(0);
  writeChildren(tile.children, out);
  if (statesMode == StatesMode::Explicit) {
    std::vector<uint8_t> packed((states.size() + 3) / 4, 0);
    for (size_t i = 0; i < states.size(); ++i) {
      packed[i / 4] |= static_cast<uint8_t>(static_cast<unsigned>(states[i]) << (2 * (i % 4)));
    }
    out.section(packed);
  }
  for (size_t i = 0; i < encoder.cornerStates.size(); ++i) {
    TERRANE_CHECK(encoder.cornerStates[i] != SampleState::Interpolated, "the world's corner {} has no ends",
                  i);
    const bool isCoded = encoder.cornerStates[i] == SampleState::Coded;
    out.uint32(isCoded ? static_cast<uint32_t>(encoder.integerAt(kCorners[i]))
                       : std::bit_cast<uint32_t>(tile.samples.heights[static_cast<size_t>(kCorners[i])]));
  }
  out.column(encoder.quadResiduals);
  out.column(encoder.edgeResiduals);
  if (coverageMode == CoverageMode::Bitmap) out.section(tile.samples.coverage.bits);
  writeNodes(tile, scale, isRoot, out);
  return out.take();
}

Result<Tile> decodeTile(std::span<const uint8_t> payload, const TileSamples* parent, int quadrant,
                        const ElevationScale& scale) {
  const bool isRoot = parent == nullptr;
  ByteReader in(payload);

  // The head says what follows.
  TERRANE_ASSIGN(const uint8_t version, in.byte());
  if (version > kVersion) {
    return makeError("byte 0: payload version {}, this program reads {}: update Terrane", version, kVersion);
  }
  if (version != kVersion) return makeError("byte 0: payload version {} does not exist", version);
  TERRANE_ASSIGN(const uint8_t flags, in.byte());
  if (flags >= 32) return makeError("byte 1: unknown flags {:#x}", flags);
  if (((flags & kFlagRoot) != 0) != isRoot) {
    return makeError("byte 1: {}",
                     isRoot ? "not a root tile, and no parent given" : "a root tile, but a parent given");
  }
  const auto statesMode = static_cast<StatesMode>(flags >> 1 & 3);
  const auto coverageMode = static_cast<CoverageMode>(flags >> 3 & 3);
  TERRANE_ASSIGN(const uint8_t reserved, in.byte());
  if (reserved != 0) return makeError("byte 2: {} instead of 0", reserved);

  Tile tile;
  TERRANE_TRY(readChildren(in, tile.children));

  // What the tile has before its own samples: its parent's, or the world's four corners.
  const OwnCounts counts = ownCounts(isRoot);
  const size_t cornerCount = isRoot ? kCorners.size() : 0;
  std::vector<SampleState> states(cornerCount + counts.quadCenters + counts.edgeCenters);
  const size_t statesStart = in.offset();
  TERRANE_TRY(readStates(in, statesMode, states));
  if (isRoot) {
    const std::span<const SampleState> cornerStates(states.data(), cornerCount);
    if (std::count(cornerStates.begin(), cornerStates.end(), SampleState::Interpolated) != 0) {
      return makeError("byte {}: a corner of the world is interpolated", statesStart);
    }
    tile.samples.heights.resize(kTileSampleCount);
    tile.samples.states.resize(kTileSampleCount);
    TERRANE_TRY(readCorners(in, cornerStates, scale, tile.samples));
  } else {
    copyParentSamples(*parent, quadrant, tile.samples);
  }

  // Its own samples, coarse to fine.
  SampleStream quads;
  SampleStream edges;
  const auto firstEdge = states.begin() + static_cast<std::ptrdiff_t>(cornerCount + counts.quadCenters);
  quads.states.assign(states.begin() + static_cast<std::ptrdiff_t>(cornerCount), firstEdge);
  edges.states.assign(firstEdge, states.end());
  const size_t residualsStart = in.offset();
  TERRANE_TRY(readResiduals(in, quads));
  TERRANE_TRY(readResiduals(in, edges));
  SampleDecoder decoder(tile.samples, scale);
  for (int s = coarsestHalfSize(isRoot); s >= 1; s /= 2) decoder.level(s, quads, edges);
  if (decoder.outOfRange()) {
    return makeError("byte {}: a height is beyond 2^24 steps of {} m", residualsStart, scale.heightStep);
  }

  TERRANE_TRY(readCoverage(in, coverageMode, tile.samples));
  TERRANE_TRY(readNodes(in, scale, isRoot, tile));
  if (in.remaining() != 0) return makeError("byte {}: {} bytes too many", in.offset(), in.remaining());
  return tile;
}

}  // namespace terrane
