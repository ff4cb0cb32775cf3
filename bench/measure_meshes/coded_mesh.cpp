#include "coded_mesh.h"

#include <algorithm>

#include "terrane/base/check.h"

namespace terrane {
namespace {

constexpr uint32_t kNorthWest = 0;
constexpr uint32_t kNorthEast = kTileCells;
constexpr uint32_t kSouthWest = kTileCells * kTileSamples;
constexpr uint32_t kSouthEast = kSouthWest + kTileCells;

/// Where an edge-centre of half-size s is split, so are the quad-centres beside it.
void closeQuadCenters(int s, SampleState* split) {
  const int up = s * kTileSamples;
  for (int y = 0; y < kTileSamples; y += s) {
    const bool onHorizontal = y % (2 * s) == 0;
    for (int x = onHorizontal ? s : 0; x < kTileSamples; x += 2 * s) {
      SampleState* const center = split + y * kTileSamples + x;
      if (*center != SampleState::Coded) continue;
      const int aside = onHorizontal ? up : s;
      const int place = onHorizontal ? y : x;
      if (place > 0) center[-aside] = SampleState::Coded;
      if (place < kTileCells) center[aside] = SampleState::Coded;
    }
  }
}

/// Where a quad-centre of half-size s is split, so are the two edge-centres at its apexes.
void closeEdgeCenters(int s, SampleState* split) {
  const int up = s * kTileSamples;
  for (int y = s; y < kTileSamples; y += 2 * s) {
    bool northWestIsEnd = (y - s) / (2 * s) % 2 == 0;
    for (int x = s; x < kTileSamples; x += 2 * s, northWestIsEnd = !northWestIsEnd) {
      SampleState* const center = split + y * kTileSamples + x;
      if (*center != SampleState::Coded) continue;
      const int turn = northWestIsEnd ? s : -s;
      center[turn - up] = SampleState::Coded;
      center[up - turn] = SampleState::Coded;
    }
  }
}

}  // namespace

/// A Void sample is never Coded, and may well have Coded descendants: it is split all the same.
void CodedMesh::closeUpwards() {
  const auto isCoded = [](SampleState state) { return state == SampleState::Coded; };
  if (std::all_of(split_.begin(), split_.end(), isCoded)) return;
  for (int s = 1; s < kTileCells; s *= 2) {
    closeQuadCenters(s, split_.data());
    // note: a tile's own square has no apexes but its corners, which are nobody's centres here.
    if (2 * s < kTileCells) closeEdgeCenters(s, split_.data());
  }
}

template <int kLevel>
void CodedMesh::walk(uint32_t apex, uint32_t left, uint32_t right) {
  if constexpr (kLevel < kSmallest) {
    const uint32_t middle = (left + right) / 2;
    if (split_[middle] == SampleState::Coded) {
      walk<kLevel + 1>(middle, apex, left);
      walk<kLevel + 1>(middle, right, apex);
      return;
    }
  }
  *next_ = {apex, left, right};
  const bool isGround = states_[apex] != SampleState::Void && states_[left] != SampleState::Void &&
                        states_[right] != SampleState::Void;
  next_ += isGround ? 1 : 0;
}

std::span<const CodedTriangle> CodedMesh::trianglesOf(const TileSamples& samples, TileId id) {
  TERRANE_CHECK(samples.states.size() == kTileSampleCount, "{} states", samples.states.size());
  split_ = samples.states;
  states_ = samples.states.data();
  closeUpwards();
  next_ = triangles_.data();
  if ((id.col + id.row) % 2 == 0) {
    walk<0>(kNorthEast, kNorthWest, kSouthEast);
    walk<0>(kSouthWest, kSouthEast, kNorthWest);
  } else {
    walk<0>(kNorthWest, kSouthWest, kNorthEast);
    walk<0>(kSouthEast, kNorthEast, kSouthWest);
  }
  return {triangles_.data(), static_cast<size_t>(next_ - triangles_.data())};
}

}  // namespace terrane
