#include "terrane/codec/elevation_codec.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "byte_streams.h"
#include "coverage_coding.h"
#include "node_coding.h"
#include "parent_samples.h"
#include "payload_check.h"
#include "rans.h"
#include "sample_coding.h"
#include "sample_lattice.h"
#include "terrane/base/bit_cast.h"
#include "terrane/base/check.h"

// docs/format/elevation-v4.md specifies every byte that is written and read here.
namespace terrane {
namespace {

constexpr uint8_t kElevationVersion = 4;
constexpr uint8_t kFlagRoot = 1;

enum class CoverageMode : uint8_t { None = 0, Full = 1, FromCorners = 2, Bitmap = 3 };

/// The finest half-size that a beginning of a root tile may lack: without it there is nothing to recognise.
constexpr int kCoarsestBeginning = 8;

constexpr std::array<int, 4> kCorners = {0, kTileCells, kTileCells* kTileSamples, kTileSampleCount - 1};

/// Which states own samples have, as the bits of one byte.
uint8_t byteOfStates(const OwnStates& states) {
  return static_cast<uint8_t>((states.anyVoid ? 1 : 0) | (states.anyInterpolated ? 2 : 0) |
                              (states.anyCoded ? 4 : 0) | (states.closed ? 8 : 0));
}
Result<OwnStates> statesOfByte(uint8_t byte, size_t offset) {
  if (byte >= 16 || (byte & 7) == 0) return makeError("byte {}: unknown states {:#x}", offset, byte);
  return OwnStates{(byte & 1) != 0, (byte & 2) != 0, (byte & 4) != 0, (byte & 8) != 0};
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

// -------------------------------------------------------------------------------------------- decoding

Status readCorners(ByteReader& in, const ElevationScale& scale, TileSamples& samples) {
  const auto largest = static_cast<float>(std::abs(scale.heightOffset) + kLargestInteger * scale.heightStep);
  const size_t statesStart = in.offset();
  TERRANE_ASSIGN(const unsigned coded, in.byte());
  if (coded >= 16) return makeError("byte {}: unknown corners {:#x}", statesStart, coded);
  for (size_t i = 0; i < kCorners.size(); ++i) {
    const size_t start = in.offset();
    TERRANE_ASSIGN(const uint32_t bits, in.uint32());
    const bool isCoded = (coded >> i & 1U) != 0;
    float height = 0.0F;
    if (isCoded) {
      const auto q = static_cast<int32_t>(bits);
      if (q > kLargestInteger || q < -kLargestInteger)
        return makeError("byte {}: corner {} at step {}", start, i, q);
      height = scale.heightFromInteger(q);
    } else {
      height = bitCast<float>(bits);
      // note: written so that NaN fails.
      if (!(std::abs(height) <= largest)) return makeError("byte {}: corner {} at {} m", start, i, height);
    }
    samples.heights[static_cast<size_t>(kCorners[i])] = height;
    samples.states[static_cast<size_t>(kCorners[i])] = isCoded ? SampleState::Coded : SampleState::Void;
  }
  return {};
}

void writeCorners(const TileSamples& samples, const ElevationScale& scale, ByteWriter& out) {
  unsigned coded = 0;
  for (size_t i = 0; i < kCorners.size(); ++i) {
    const SampleState state = samples.states[static_cast<size_t>(kCorners[i])];
    TERRANE_CHECK(state != SampleState::Interpolated, "the world's corner {} has no ends", i);
    if (state == SampleState::Coded) coded |= 1U << i;
  }
  out.byte(static_cast<uint8_t>(coded));
  for (size_t i = 0; i < kCorners.size(); ++i) {
    const float height = samples.heights[static_cast<size_t>(kCorners[i])];
    out.uint32((coded >> i & 1U) != 0 ? static_cast<uint32_t>(integerOfCoded(height, scale))
                                      : bitCast<uint32_t>(height));
  }
}

/// Passes over one segment of answers or of numbers. Error: it is not whole.
Status skipSegment(std::span<const uint8_t> payload, size_t& at, bool isAnswers) {
  size_t used = 0;
  const auto rest = payload.subspan(at);
  const auto fail = [&](const Error& error) {
    return makeError("segment at byte {}: {}", at, error.message);
  };
  if (isAnswers) {
    if (const auto segment = BinaryReader::open(rest, used); !segment.ok()) return fail(segment.error());
  } else {
    if (const auto segment = SegmentReader::open(rest, used); !segment.ok()) return fail(segment.error());
  }
  at += used;
  return {};
}

/// Passes over the segments of one lattice level: of quad-centres, then of edge-centres.
Status skipLevel(std::span<const uint8_t> payload, size_t& at, const OwnStates& states) {
  for (int i = 0; i < 2; ++i) {
    if (states.hasAnswers()) TERRANE_TRY(skipSegment(payload, at, true));
    if (states.hasNumbers()) TERRANE_TRY(skipSegment(payload, at, false));
  }
  return {};
}

/// Do exactly these segments follow: of samples, so many levels; of coverage; of nodes?
Status checkSegments(std::span<const uint8_t> payload, size_t start, const OwnStates& states, int levels,
                     bool hasCoverage) {
  for (int i = 0; i < levels; ++i) TERRANE_TRY(skipLevel(payload, start, states));
  if (hasCoverage) TERRANE_TRY(skipSegment(payload, start, true));
  TERRANE_TRY(skipSegment(payload, start, true));
  if (start != payload.size()) return makeError("byte {}: {} bytes too many", start, payload.size() - start);
  return {};
}

/// What a payload says before its segments.
struct ElevationHead {
  CoverageMode coverageMode = CoverageMode::None;
  OwnStates states;
};

Status readVersion(ByteReader& in) {
  TERRANE_ASSIGN(const uint8_t version, in.byte());
  if (version > kElevationVersion) {
    return makeError("byte 0: payload version {}, this program reads {}: update Terrane", version,
                     kElevationVersion);
  }
  if (version == 0) return makeError("byte 0: payload version 0 does not exist");
  if (version != kElevationVersion) {
    return makeError("byte 0: payload version {}, this program reads {}: build the dataset again", version,
                     kElevationVersion);
  }
  return in.skip(kCheckedFrom - kCheckOffset);
}

/// Reads what follows version and check, up to the first segment; also what the tile has before its own
/// samples: its parent's, or the world's four corners.
Result<ElevationHead> readHead(ByteReader& in, const TileSamples* parent, int quadrant,
                               const ElevationScale& scale, Tile& tile) {
  const bool isRoot = parent == nullptr;
  ElevationHead head;
  const size_t flagsStart = in.offset();
  TERRANE_ASSIGN(const uint8_t flags, in.byte());
  if (flags >= 8) return makeError("byte {}: unknown flags {:#x}", flagsStart, flags);
  if (((flags & kFlagRoot) != 0) != isRoot) {
    return makeError("byte {}: {}", flagsStart,
                     isRoot ? "not a root tile, and no parent given" : "a root tile, but a parent given");
  }
  head.coverageMode = static_cast<CoverageMode>(flags >> 1);
  const size_t statesStart = in.offset();
  TERRANE_ASSIGN(const uint8_t stateBits, in.byte());
  TERRANE_ASSIGN(head.states, statesOfByte(stateBits, statesStart));
  TERRANE_TRY(readChildren(in, tile.children));
  const SampleState usual = usualState(head.states);
  if (isRoot) {
    tile.samples.heights.resize(kTileSampleCount);
    tile.samples.states.assign(kTileSampleCount, usual);
    TERRANE_TRY(readCorners(in, scale, tile.samples));
  } else {
    if (parent->layerCount > 1)
      copyParentSamples(samplesOfLayer(*parent, 0), quadrant, usual, tile.samples);
    else
      copyParentSamples(*parent, quadrant, usual, tile.samples);
  }
  tile.samples.layerCount = 1;
  tile.samples.layers.clear();
  return head;
}

Coverage coverageOf(CoverageMode mode, const std::vector<SampleState>& states) {
  if (mode == CoverageMode::None) return {};
  if (mode == CoverageMode::Full) return {Coverage::Kind::Full, {}};
  return {Coverage::Kind::Partial, coverageFromCorners(states)};
}

/// Codes that are true of any tile with these children: heights anywhere in their range, and an error of
/// all of it, rising from level to level.
TileNodes widestNodes(const std::array<ChildSummary, 4>& children, const ElevationScale& scale) {
  uint16_t low = 65535, high = 0;
  for (const ChildSummary& child : children) {
    low = std::min(low, child.low);
    high = std::max(high, child.high);
  }
  const int finest = scale.codeFromError(low <= high ? scale.rangeUnit * (high - low) : 0.0);
  const auto codeAt = [&](int nodeLevel) {
    return static_cast<uint8_t>(std::min(255, finest + kNodeLevels - 1 - nodeLevel));
  };
  TileNodes nodes;
  nodes.low.assign(static_cast<size_t>(tileNodeCount(true)), low);
  nodes.high.assign(static_cast<size_t>(tileNodeCount(true)), high);
  for (int level = 0; level < kNodeLevels; ++level)
    nodes.error.insert(nodes.error.end(), static_cast<size_t>(nodeCount(level)), codeAt(level));
  for (int k = 5; k <= 7; ++k)
    for (int level = firstLargeNodeLevel(k, true); level <= lastLargeNodeLevel(k); ++level)
      nodes.largeError.insert(nodes.largeError.end(), static_cast<size_t>(nodeCount(level)), codeAt(level));
  return nodes;
}

}  // namespace

std::vector<uint8_t> encodeTile(const Tile& tile, const TileSamples* parent, int quadrant,
                                const ElevationScale& scale) {
  checkShapes(tile, parent, quadrant);
  if (tile.samples.layerCount > 1) {
    Tile first = tile;
    first.samples = samplesOfLayer(tile.samples, 0);
    if (parent == nullptr) return encodeTile(first, nullptr, quadrant, scale);
    const TileSamples above = samplesOfLayer(*parent, 0);
    return encodeTile(first, &above, quadrant, scale);
  }
  if (parent != nullptr) checkParentSamples(tile.samples, *parent, quadrant);
  const bool isRoot = parent == nullptr;

  const OwnStates states = ownStatesOf(tile.samples.states, isRoot);
  const CoverageMode coverageMode = coverageModeOf(tile.samples);

  std::unique_ptr<SampleModels> models;
  if (states.hasAnswers()) models = std::make_unique<SampleModels>();
  ByteWriter head;
  head.byte(kElevationVersion);
  head.uint16(0);  // the check, when all else is there
  head.byte(static_cast<uint8_t>((isRoot ? kFlagRoot : 0) | static_cast<unsigned>(coverageMode) << 1));
  head.byte(byteOfStates(states));
  writeChildren(tile.children, head);
  if (isRoot) writeCorners(tile.samples, scale, head);
  std::vector<uint8_t> out = head.take();
  for (int s = coarsestHalfSize(isRoot); s >= 1; s /= 2)
    encodeLevel(tile.samples, s, 0, states, scale, models.get(), out);
  if (coverageMode == CoverageMode::Bitmap) encodeCoverage(tile.samples, out);
  encodeNodes(tile, scale, isRoot, out);
  sealPayload(out);
  return out;
}

Result<Tile> decodeTile(std::span<const uint8_t> payload, const TileSamples* parent, int quadrant,
                        const ElevationScale& scale, Tile recycled) {
  const bool isRoot = parent == nullptr;
  ByteReader in(payload);
  TERRANE_TRY(readVersion(in));
  TERRANE_TRY(checkPayload(payload));
  Tile tile = std::move(recycled);
  TERRANE_ASSIGN(const ElevationHead head, readHead(in, parent, quadrant, scale, tile));

  // All segments are whole before any of them is decoded.
  int levels = 0;
  for (int s = coarsestHalfSize(isRoot); s >= 1; s /= 2) ++levels;
  TERRANE_TRY(
      checkSegments(payload, in.offset(), head.states, levels, head.coverageMode == CoverageMode::Bitmap));

  // Its own samples, coarse to fine.
  std::unique_ptr<SampleModels> models;
  if (head.states.hasAnswers()) models = std::make_unique<SampleModels>();
  for (int s = coarsestHalfSize(isRoot); s >= 1; s /= 2) {
    const auto used =
        decodeLevel(payload.subspan(in.offset()), s, 0, head.states, scale, models.get(), tile.samples);
    if (!used.ok()) return makeError("at byte {}: {}", in.offset(), used.error().message);
    TERRANE_TRY(in.skip(*used));
  }

  if (head.coverageMode == CoverageMode::Bitmap) {
    const auto used = decodeCoverage(payload.subspan(in.offset()), tile.samples);
    if (!used.ok()) return makeError("at byte {}: {}", in.offset(), used.error().message);
    TERRANE_TRY(in.skip(*used));
  } else {
    tile.samples.coverage = coverageOf(head.coverageMode, tile.samples.states);
  }
  const auto used = decodeNodes(payload.subspan(in.offset()), scale, isRoot, tile);
  if (!used.ok()) return makeError("at byte {}: {}", in.offset(), used.error().message);
  TERRANE_TRY(in.skip(*used));
  return tile;
}

Result<Tile> decodeRootBeginning(std::span<const uint8_t> beginning, const ElevationScale& scale) {
  ByteReader in(beginning);
  TERRANE_TRY(readVersion(in));
  Tile tile;
  TERRANE_ASSIGN(const ElevationHead head, readHead(in, nullptr, 0, scale, tile));

  std::unique_ptr<SampleModels> models;
  if (head.states.hasAnswers()) models = std::make_unique<SampleModels>();
  int s = kCoarsestHalfSize;
  for (; s >= 1; s /= 2) {
    size_t end = in.offset();
    if (!skipLevel(beginning, end, head.states).ok()) break;
    const auto used =
        decodeLevel(beginning.subspan(in.offset()), s, 0, head.states, scale, models.get(), tile.samples);
    if (!used.ok()) return makeError("at byte {}: {}", in.offset(), used.error().message);
    TERRANE_TRY(in.skip(*used));
  }
  if (s > kCoarsestBeginning)
    return makeError("byte {}: the beginning of a root tile ends before its coarse levels", beginning.size());
  for (; s >= 1; s /= 2) interpolateLevel(s, tile.samples);
  tile.samples.coverage = coverageOf(head.coverageMode, tile.samples.states);
  tile.nodes = widestNodes(tile.children, scale);
  return tile;
}

}  // namespace terrane
