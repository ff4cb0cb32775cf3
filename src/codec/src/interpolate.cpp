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

/// 129 heights to every second place; what is between becomes the same, for now.
TERRANE_CLONES void spreadHeights(const float* __restrict from, float* __restrict to) {
  for (size_t x = 0; x < kTileCells / 2; ++x) {
    uint32_t bits;
    std::memcpy(&bits, from + x, sizeof(bits));
    const uint64_t twice = uint64_t{bits} << 32 | bits;
    std::memcpy(to + 2 * x, &twice, sizeof(twice));
  }
  to[kTileCells] = from[kTileCells / 2];
}

}  // namespace

void copyParentSamples(const TileSamples& parent, int quadrant, TileSamples& child) {
  TERRANE_CHECK(quadrant >= 0 && quadrant < 4, "quadrant {}", quadrant);
  TERRANE_CHECK(parent.heights.size() == kTileSampleCount && parent.states.size() == kTileSampleCount,
                "{} heights, {} states", parent.heights.size(), parent.states.size());
  child.heights.resize(kTileSampleCount);
  child.states.assign(kTileSampleCount, SampleState::Coded);

  const int firstX = (quadrant & 1) * (kTileCells / 2);
  const int firstY = (quadrant >> 1) * (kTileCells / 2);
  constexpr size_t kHalf = kTileCells / 2;
  constexpr std::array<SampleState, kHalf + 1> kAllCoded = [] {
    std::array<SampleState, kHalf + 1> all{};
    all.fill(SampleState::Coded);
    return all;
  }();
  for (int y = 0; y <= kTileCells / 2; ++y) {
    const auto from = static_cast<size_t>((firstY + y) * kTileSamples + firstX);
    const auto to = static_cast<size_t>(2 * y * kTileSamples);
    spreadHeights(parent.heights.data() + from, child.heights.data() + to);
    if (std::memcmp(parent.states.data() + from, kAllCoded.data(), kAllCoded.size()) == 0) continue;
    for (size_t x = 0; x <= kHalf; ++x) child.states[to + 2 * x] = parent.states[from + x];
  }
}

void interpolateLevel(int s, TileSamples& samples) {
  // note: the states' values make "ground" and Interpolated the same number.
  static_assert(static_cast<int>(SampleState::Void) == 0 && static_cast<int>(SampleState::Interpolated) == 1);
  float* heights = samples.heights.data();
  SampleState* states = samples.states.data();
  const auto isGround = [&](int index) { return states[index] != SampleState::Void ? 1U : 0U; };
  visitQuadCenters(s, [&](int center, int endA, int endB, int apexA, int apexB) {
    heights[center] = (heights[endA] + heights[endB]) * 0.5F;
    const unsigned ground = isGround(endA) & isGround(endB) & isGround(apexA) & isGround(apexB);
    states[center] = static_cast<SampleState>(ground);
  });
  visitEdgeCenters(s, [&](int center, int endA, int endB, int, int) {
    heights[center] = (heights[endA] + heights[endB]) * 0.5F;
    states[center] = static_cast<SampleState>(isGround(endA) & isGround(endB));
  });
}

TileSamples interpolateSamples(const TileSamples& parent, int quadrant) {
  TileSamples child;
  copyParentSamples(parent, quadrant, child);
  child.coverage = doubleCoverage(parent.coverage, quadrant);

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
