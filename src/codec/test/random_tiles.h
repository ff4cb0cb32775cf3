#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "terrane/codec/elevation_codec.h"
#include "terrane/tiling/lattice.h"

/// Tiles made up at random, by the lattice's own arithmetic (tiling/lattice.h) and none of the codec's.
namespace terrane {

struct RandomTileOptions {
  double voidShare = 0.0;          ///< of the 32 x 32 blocks of samples
  double interpolatedShare = 0.0;  ///< of the 32 x 32 blocks of samples
  int32_t roughness = 20;          ///< steps that a coded sample lies off its ends' mean, at most
  int32_t startRange = 2000;       ///< the world's corners lie within +- so many steps
  bool partialCoverage = false;    ///< a coverage that nothing follows from
};

/// The samples of `tile` in the order in which they become known; without the parent's, unless it is the
/// root.
inline std::vector<Diamond> ownDiamonds(TileId tile) {
  const Lattice lattice(tile.level);
  std::vector<Diamond> own;
  for (int y = 0; y < kTileSamples; ++y) {
    for (int x = 0; x < kTileSamples; ++x) {
      const bool isCorner = x % kTileCells == 0 && y % kTileCells == 0;
      if (tile.isRoot() ? isCorner : x % 2 == 0 && y % 2 == 0) continue;
      own.push_back(lattice.diamondAt({tile.col * kTileCells + x, tile.row * kTileCells + y}));
    }
  }
  std::stable_sort(own.begin(), own.end(),
                   [](const Diamond& a, const Diamond& b) { return a.level < b.level; });
  return own;
}

inline Tile randomTile(TileId id, const TileSamples* parent, const ElevationScale& scale,
                       const RandomTileOptions& options, std::mt19937& random) {
  const auto indexOf = [&](LatticePoint p) {
    return static_cast<size_t>((p.y - id.row * kTileCells) * kTileSamples + (p.x - id.col * kTileCells));
  };
  const auto steps = [&](int32_t range) {
    return static_cast<int32_t>(random() % static_cast<uint32_t>(2 * range + 1)) - range;
  };
  Tile tile;
  TileSamples& samples = tile.samples;
  samples.heights.assign(kTileSampleCount, 0.0F);
  samples.states.assign(kTileSampleCount, SampleState::Void);

  // Whole blocks are void or interpolated, as holes and plains are.
  std::vector<SampleState> blocks(9 * 9, SampleState::Coded);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (SampleState& block : blocks) {
    const double dice = share(random);
    if (dice < options.voidShare) {
      block = SampleState::Void;
    } else if (dice < options.voidShare + options.interpolatedShare) {
      block = SampleState::Interpolated;
    }
  }

  // What is known before: the parent's samples, or the world's corners.
  if (parent != nullptr) {
    for (int y = 0; y < kTileSamples; y += 2) {
      for (int x = 0; x < kTileSamples; x += 2) {
        const int parentX = (id.col & 1) * kTileCells / 2 + x / 2;
        const int parentY = (id.row & 1) * kTileCells / 2 + y / 2;
        const auto from = static_cast<size_t>(parentY * kTileSamples + parentX);
        const auto to = static_cast<size_t>(y * kTileSamples + x);
        samples.heights[to] = parent->heights[from];
        samples.states[to] = parent->states[from];
      }
    }
  } else {
    for (const int y : {0, kTileCells}) {
      for (const int x : {0, kTileCells}) {
        const auto corner = static_cast<size_t>(y * kTileSamples + x);
        const bool isVoid = options.voidShare > 0.0 && random() % 2 == 0;
        samples.states[corner] = isVoid ? SampleState::Void : SampleState::Coded;
        samples.heights[corner] = isVoid ? 17.3F * static_cast<float>(scale.heightStep)
                                         : scale.heightFromInteger(steps(options.startRange));
      }
    }
  }

  const Lattice lattice(id.level);
  for (const Diamond& d : ownDiamonds(id)) {
    const auto ends = lattice.hypotenuse(d);
    const size_t index = indexOf(d.center());
    const float mean = (samples.heights[indexOf(ends[0])] + samples.heights[indexOf(ends[1])]) * 0.5F;
    const size_t x = index % kTileSamples;
    const size_t y = index / kTileSamples;
    samples.states[index] = blocks[y / 32 * 9 + x / 32];
    samples.heights[index] = mean;
    if (samples.states[index] == SampleState::Coded) {
      const int64_t q = scale.integerFromHeight(static_cast<double>(mean)) + steps(options.roughness);
      samples.heights[index] = scale.heightFromInteger(std::clamp<int64_t>(q, -16777215, 16777215));
    }
  }

  // Coverage, as it follows from the states or as it pleases.
  samples.coverage.kind = Coverage::Kind::Partial;
  samples.coverage.bits.assign(Coverage::kBytes, 0);
  for (int cell = 0; cell < kTileCellCount; ++cell) {
    const int corner = cell / kTileCells * kTileSamples + cell % kTileCells;
    bool ground = true;
    for (const int other : {0, 1, kTileSamples, kTileSamples + 1}) {
      ground &= samples.states[static_cast<size_t>(corner + other)] != SampleState::Void;
    }
    if (options.partialCoverage) ground = random() % 5 != 0;
    if (ground)
      samples.coverage.bits[static_cast<size_t>(cell / 8)] |= static_cast<uint8_t>(1U << (cell % 8));
  }
  if (options.voidShare == 0.0 && !options.partialCoverage) samples.coverage = {Coverage::Kind::Full, {}};
  if (options.voidShare >= 1.0 && !options.partialCoverage) samples.coverage = {};

  // Node codes: anything the format can hold, smooth enough to be squeezed.
  const auto nodes = static_cast<size_t>(tileNodeCount(parent == nullptr));
  for (int i = 0; i < tileLargeNodeCount(parent == nullptr); ++i)
    tile.nodes.largeError.push_back(static_cast<uint8_t>(random() % 64));
  for (size_t i = 0; i < nodes; ++i) {
    const bool isEmpty = random() % 16 == 0;
    const auto low = static_cast<uint16_t>(1000 + random() % 200);
    tile.nodes.error.push_back(static_cast<uint8_t>(random() % 64));
    tile.nodes.low.push_back(isEmpty ? 65535 : low);
    tile.nodes.high.push_back(isEmpty ? 0 : static_cast<uint16_t>(low + random() % 64000));
  }
  for (ChildSummary& child : tile.children) {
    child.state = static_cast<ChildState>(random() % 3);
    if (child.state == ChildState::Present) child.error = static_cast<uint8_t>(random() % 256);
    if (child.state != ChildState::Void) child.low = static_cast<uint16_t>(random() % 1000);
    if (child.state != ChildState::Void) child.high = static_cast<uint16_t>(1000 + random() % 64000);
  }
  return tile;
}

}  // namespace terrane
