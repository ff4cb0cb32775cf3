#include <algorithm>
#include <array>
#include <cstring>

#include "parent_samples.h"
#include "sample_lattice.h"
#include "terrane/base/check.h"
#include "terrane/codec/elevation_codec.h"
#include "vector_clones.h"

namespace terrane {
namespace {

/// The parent's cells of a quadrant, each as four.
Coverage doubleCoverage(const Coverage& parent, int quadrant) {
  Coverage child;
  child.kind = parent.kind;
  if (parent.kind != Coverage::Kind::Partial) return child;

  child.bits.assign(Coverage::kBytes, 0);
  constexpr int kRowBytes = kTileCells / 8;
  const int firstCol = (quadrant & 1) * (kTileCells / 2);
  const int firstRow = (quadrant >> 1) * (kTileCells / 2);
  for (int row = 0; row < kTileCells; ++row) {
    const size_t from = static_cast<size_t>((firstRow + row / 2) * kRowBytes + firstCol / 8);
    const size_t to = static_cast<size_t>(row * kRowBytes);
    for (size_t byte = 0; byte < kRowBytes; ++byte) {
      // Four bits of the parent become the eight of this byte: spread them, then double each.
      unsigned bits = parent.bits[from + byte / 2] >> (byte % 2 * 4) & 15U;
      bits = (bits | bits << 2) & 0x33U;
      bits = (bits | bits << 1) & 0x55U;
      child.bits[to + byte] = static_cast<uint8_t>(bits | bits << 1);
    }
  }

  // A quadrant may well be uniform although the parent is not.
  const auto isByte = [](uint8_t value) { return [value](uint8_t byte) { return byte == value; }; };
  if (std::all_of(child.bits.begin(), child.bits.end(), isByte(0))) {
    child.kind = Coverage::Kind::None;
  } else if (std::all_of(child.bits.begin(), child.bits.end(), isByte(255))) {
    child.kind = Coverage::Kind::Full;
  }
  if (child.kind != Coverage::Kind::Partial) child.bits.clear();
  return child;
}

constexpr size_t kHalf = kTileCells / 2;

/// 129 heights to every second place; what is between becomes the same, for now.
TERRANE_CLONES void spreadHeights(const float* __restrict from, float* __restrict to) {
  for (size_t x = 0; x < kHalf; ++x) {
    uint32_t bits;
    std::memcpy(&bits, from + x, sizeof(bits));
    const uint64_t twice = uint64_t{bits} << 32 | bits;
    std::memcpy(to + 2 * x, &twice, sizeof(twice));
  }
  to[kTileCells] = from[kHalf];
}

/// 129 states to every second place, one and the same between them.
TERRANE_CLONES void spreadStates(const SampleState* __restrict from, SampleState between,
                                 SampleState* __restrict to) {
  for (size_t x = 0; x < kHalf; ++x) {
    to[2 * x] = from[x];
    to[2 * x + 1] = between;
  }
  to[kTileCells] = from[kHalf];
}

using HalfRow = std::array<float, kHalf + 1>;
TERRANE_CLONES void takeEverySecond(const float* __restrict row, HalfRow& __restrict out) {
  for (size_t x = 0; x < kHalf; ++x) out[x] = row[2 * x];
  out[kHalf] = row[kTileCells];
}
/// A row of corners with the horizontal edges between them.
TERRANE_CLONES void meansAlong(const HalfRow& __restrict corners, float* __restrict to) {
  for (size_t x = 0; x < kHalf; ++x) {
    to[2 * x] = corners[x];
    to[2 * x + 1] = (corners[x] + corners[x + 1]) * 0.5F;
  }
}
/// The row between two rows of corners: vertical edges and quad-centres, of which the first one's hypotenuse
/// begins in the north-west, or not.
TERRANE_CLONES void meansAcross(const HalfRow& __restrict north, const HalfRow& __restrict south,
                                bool northWestFirst, float* __restrict to) {
  const HalfRow& first = northWestFirst ? north : south;
  const HalfRow& second = northWestFirst ? south : north;
  for (size_t x = 0; x < kHalf; x += 2) {
    to[2 * x] = (north[x] + south[x]) * 0.5F;
    to[2 * x + 1] = (first[x] + second[x + 1]) * 0.5F;
    to[2 * x + 2] = (north[x + 1] + south[x + 1]) * 0.5F;
    to[2 * x + 3] = (second[x + 1] + first[x + 2]) * 0.5F;
  }
  to[kTileCells] = (north[kHalf] + south[kHalf]) * 0.5F;
}

/// The finest level: whole rows at once.
void interpolateFinestHeights(float* heights) {
  std::array<HalfRow, 2> corners;
  takeEverySecond(heights, corners[0]);
  for (size_t y = 0; y <= kHalf; ++y) {
    const HalfRow& north = corners[y % 2];
    HalfRow& south = corners[1 - y % 2];
    float* row = heights + 2 * y * kTileSamples;
    meansAlong(north, row);
    if (y == kHalf) break;
    takeEverySecond(row + 2 * kTileSamples, south);
    meansAcross(north, south, y % 2 == 0, row + kTileSamples);
  }
}

}  // namespace

void copyParentSamples(const TileSamples& parent, int quadrant, SampleState others, TileSamples& child) {
  TERRANE_CHECK(quadrant >= 0 && quadrant < 4, "quadrant {}", quadrant);
  TERRANE_CHECK(parent.heights.size() == kTileSampleCount && parent.states.size() == kTileSampleCount,
                "{} heights, {} states", parent.heights.size(), parent.states.size());
  child.heights.resize(kTileSampleCount);
  child.states.assign(kTileSampleCount, others);

  const int firstX = (quadrant & 1) * (kTileCells / 2);
  const int firstY = (quadrant >> 1) * (kTileCells / 2);
  std::array<SampleState, kHalf + 1> usual;
  usual.fill(others);
  for (int y = 0; y <= kTileCells / 2; ++y) {
    const auto from = static_cast<size_t>((firstY + y) * kTileSamples + firstX);
    const auto to = static_cast<size_t>(2 * y * kTileSamples);
    spreadHeights(parent.heights.data() + from, child.heights.data() + to);
    if (std::memcmp(parent.states.data() + from, usual.data(), usual.size()) == 0) continue;
    spreadStates(parent.states.data() + from, others, child.states.data() + to);
  }
}

void checkParentSamples(const TileSamples& samples, const TileSamples& parent, int quadrant) {
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

void interpolateOthers(int s, TileSamples& samples) {
  const auto set = [&](int center, int endA, int endB, int, int) {
    float* heights = samples.heights.data();
    if (samples.states[static_cast<size_t>(center)] != SampleState::Coded)
      heights[center] = (heights[endA] + heights[endB]) * 0.5F;
  };
  visitQuadCenters(s, set);
  visitEdgeCenters(s, set);
}

void interpolateHeights(int s, std::vector<float>& heights) {
  if (s == 1) return interpolateFinestHeights(heights.data());
  const auto setMean = [&](int center, int endA, int endB, int, int) {
    float* at = heights.data();
    at[center] = (at[endA] + at[endB]) * 0.5F;
  };
  visitQuadCenters(s, setMean);
  visitEdgeCenters(s, setMean);
}

void interpolateLevel(int s, TileSamples& samples) {
  // note: the states' values make "ground" and Interpolated the same number.
  static_assert(static_cast<int>(SampleState::Void) == 0 && static_cast<int>(SampleState::Interpolated) == 1);
  interpolateHeights(s, samples.heights);
  SampleState* states = samples.states.data();
  const auto isGround = [&](int index) { return states[index] != SampleState::Void ? 1U : 0U; };
  visitQuadCenters(s, [&](int center, int endA, int endB, int apexA, int apexB) {
    const unsigned ground = isGround(endA) & isGround(endB) & isGround(apexA) & isGround(apexB);
    states[center] = static_cast<SampleState>(ground);
  });
  visitEdgeCenters(s, [&](int center, int endA, int endB, int, int) {
    states[center] = static_cast<SampleState>(isGround(endA) & isGround(endB));
  });
}

void copyParentLayers(const TileSamples& parent, int quadrant, TileSamples& child) {
  const int firstX = (quadrant & 1) * (kTileCells / 2);
  const int firstY = (quadrant >> 1) * (kTileCells / 2);
  for (int y = 0; y <= kTileCells / 2; ++y) {
    const auto from = static_cast<size_t>((firstY + y) * kTileSamples + firstX);
    uint8_t* to = child.layers.data() + 2 * y * kTileSamples;
    for (size_t x = 0; x <= kHalf; ++x) to[2 * x] = static_cast<uint8_t>(parent.layerAt(from + x));
  }
}

TileSamples interpolateSamples(const TileSamples& parent, int quadrant) {
  TileSamples child;
  copyParentSamples(parent, quadrant, SampleState::Interpolated, child);
  child.coverage = doubleCoverage(parent.coverage, quadrant);
  child.layerCount = parent.layerCount;
  if (!parent.layers.empty()) {
    child.layers.assign(kTileSampleCount, 0);
    copyParentLayers(parent, quadrant, child);
  }

  interpolateLevel(1, child);
  return child;
}

Tile interpolateTile(const Tile& parent, int quadrant) {
  TERRANE_CHECK(quadrant >= 0 && quadrant < 4, "quadrant {}", quadrant);
  const ChildSummary& summary = parent.children[static_cast<size_t>(quadrant)];
  TERRANE_CHECK(summary.state != ChildState::Present, "quadrant {} has a stored tile", quadrant);

  Tile tile;
  tile.samples = interpolateSamples(parent.samples, quadrant);
  if (summary.state == ChildState::Void) {
    // note: the parent's border may be ground of the neighbour's; nothing in here is.
    std::fill(tile.samples.states.begin(), tile.samples.states.end(), SampleState::Void);
    tile.samples.coverage = Coverage{};
  }
  const size_t nodes = static_cast<size_t>(tileNodeCount(false));
  tile.nodes.error.assign(nodes, 0);
  tile.nodes.largeError.assign(static_cast<size_t>(tileLargeNodeCount(false)), 0);
  tile.nodes.low.assign(nodes, summary.low);
  tile.nodes.high.assign(nodes, summary.high);
  tile.children.fill({summary.state, 0, summary.low, summary.high});
  return tile;
}

}  // namespace terrane
