#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "terrane/codec/tile.h"
#include "terrane/tiling/tile_id.h"

/// What a tile's heights give to lighting: gradients at its samples on seven levels, each the average of the
/// one before, so that a pixel can be lit by the mean slope of the ground it covers.
///
/// The levels of a tile lie in one picture, its *atlas*: level 0, 257 x 257, on the left; level n, 256 / 2^n
/// + 1 samples a side, in the column beside it, below level n - 1. All are vertex-registered: sample i of
/// level n stands at sample i * 2^n of the tile, so that bilinear interpolation never leaves its level.
///
/// A gradient on a tile's border depends on both sides. Each tile can only tell its own side's; the gradient
/// that is drawn is the mean over the tiles of that level which share the sample and are here. Averaging by
/// level keeps this true: the coarser border values follow from the finer border values of the same side.
///
/// Cells without ground do not count: a gradient is the mean over the ground, so that neither holes nor the
/// data's edge throw shadows.
namespace terrane {

inline constexpr int kGradientLevels = 7;
inline constexpr int kAtlasWidth = kTileSamples + kTileCells / 2 + 1;
inline constexpr int kAtlasHeight = 258;

/// Samples along the side of a gradient level.
constexpr int gradientSide(int level) {
  return (kTileCells >> level) + 1;
}
/// Where a gradient level's first sample lies in the atlas.
constexpr int atlasX(int level) {
  return level == 0 ? 0 : kTileSamples;
}
constexpr int atlasY(int level) {
  int y = 0;
  for (int l = 1; l < level; ++l) y += gradientSide(l);
  return y;
}
static_assert(atlasY(kGradientLevels - 1) + gradientSide(kGradientLevels - 1) <= kAtlasHeight);

/// A sum of gradients, in metres a cell, x east, y south, and of their weights.
struct Gradient {
  float x = 0.0F;
  float y = 0.0F;
  float weight = 0.0F;  ///< 0 to 1 a tile: the share of ground around the sample

  friend Gradient operator+(const Gradient& a, const Gradient& b) {
    return {a.x + b.x, a.y + b.y, a.weight + b.weight};
  }
  friend Gradient operator*(float factor, const Gradient& a) {
    return {factor * a.x, factor * a.y, factor * a.weight};
  }
};

/// The sides of a tile.
enum class Side : uint8_t { North = 0, East = 1, South = 2, West = 3 };
inline constexpr std::array<Side, 4> kSides = {Side::North, Side::East, Side::South, Side::West};

/// A tile's own gradients along its border, from its own cells alone. Along a side samples run east or south.
class BorderGradients {
 public:
  BorderGradients();
  Gradient& at(Side side, int level, int index) {
    return values_[offset(side, level) + static_cast<size_t>(index)];
  }
  const Gradient& at(Side side, int level, int index) const {
    return values_[offset(side, level) + static_cast<size_t>(index)];
  }

  /// All of them; their number stays.
  std::vector<Gradient>& values() { return values_; }
  const std::vector<Gradient>& values() const { return values_; }

 private:
  static size_t offset(Side side, int level);
  std::vector<Gradient> values_;
};

/// A mean gradient as two half-precision floats, as it lies in the atlas: x in the low half.
using PackedGradient = uint32_t;
/// The mean of a sum; zero where there is no ground.
PackedGradient packGradient(Gradient sum);

struct TileShading {
  std::vector<PackedGradient> atlas;  ///< kAtlasWidth * kAtlasHeight, with the tile's own borders
  BorderGradients borders;
};

/// The gradients of a tile's heights (kTileSampleCount, finite) where there is ground. A pure function, about
/// two milliseconds; any thread.
TileShading makeTileShading(const std::vector<float>& heights, const Coverage& coverage);

}  // namespace terrane
