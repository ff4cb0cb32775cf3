#include "tile_shading.h"

#include <algorithm>

#include "terrane/base/bit_cast.h"
#include "terrane/base/check.h"

namespace terrane {

namespace {

/// Half precision, nearest, values beyond its range clamped.
uint32_t halfFromFloat(float value) {
  const auto bits = bitCast<uint32_t>(std::clamp(value, -65504.0F, 65504.0F));
  const uint32_t sign = bits >> 16 & 0x8000U;
  const uint32_t magnitude = bits & 0x7fffffffU;
  // Below 2^-14 halves are multiples of 2^-24.
  if (magnitude < 0x38800000U)
    return sign | static_cast<uint32_t>(bitCast<float>(magnitude) * 16777216.0F + 0.5F);
  return sign | ((magnitude - 0x38000000U + 0x1000U) >> 13);
}

/// Sums of gradients of one level, row by row.
using Level = std::vector<Gradient>;

size_t indexOf(int side, int x, int y) {
  return static_cast<size_t>(y) * static_cast<size_t>(side) + static_cast<size_t>(x);
}

/// The gradient of each cell, or nothing where it is not ground.
Level gradientsOfCells(const std::vector<float>& heights, const Coverage& coverage) {
  constexpr int n = kTileSamples;
  Level out(static_cast<size_t>(kTileCellCount));
  const bool full = coverage.kind == Coverage::Kind::Full;
  for (int y = 0; y < kTileCells; ++y)
    for (int x = 0; x < kTileCells; ++x) {
      if (!full && !coverage.covered(x, y)) continue;
      const float northWest = heights[indexOf(n, x, y)];
      const float northEast = heights[indexOf(n, x + 1, y)];
      const float southWest = heights[indexOf(n, x, y + 1)];
      const float southEast = heights[indexOf(n, x + 1, y + 1)];
      out[indexOf(kTileCells, x, y)] = {0.5F * ((northEast - northWest) + (southEast - southWest)),
                                        0.5F * ((southWest - northWest) + (southEast - northEast)), 1.0F};
    }
  return out;
}

/// At each sample the mean over the tile's cells around it: four, on its border two, in its corners one.
Level gradientsAtSamples(const Level& cells) {
  constexpr int n = kTileSamples;
  Level out(static_cast<size_t>(kTileSampleCount));
  for (int y = 0; y < n; ++y) {
    const int above = std::max(y - 1, 0);
    const int below = std::min(y, kTileCells - 1);
    for (int x = 0; x < n; ++x) {
      const int left = std::max(x - 1, 0);
      const int right = std::min(x, kTileCells - 1);
      const auto cell = [&](int column, int row) { return cells[indexOf(kTileCells, column, row)]; };
      out[indexOf(n, x, y)] =
          0.25F * ((cell(left, above) + cell(right, above)) + (cell(left, below) + cell(right, below)));
    }
  }
  return out;
}

/// The next coarser level: weights 1/4, 1/2, 1/4 both ways, on the border 1/2, 1/2 of its own side.
Level halve(const Level& fine, int fineSide) {
  const int side = fineSide / 2 + 1;
  // The samples before and after a coarse one; on the border both are the one inside.
  const auto before = [](int i) { return i == 0 ? 1 : 2 * i - 1; };
  const auto after = [side](int i) { return i == side - 1 ? 2 * i - 1 : 2 * i + 1; };
  Level rows(static_cast<size_t>(side) * static_cast<size_t>(fineSide));
  for (int y = 0; y < fineSide; ++y)
    for (int x = 0; x < side; ++x)
      rows[indexOf(side, x, y)] =
          0.5F * fine[indexOf(fineSide, 2 * x, y)] +
          0.25F * (fine[indexOf(fineSide, before(x), y)] + fine[indexOf(fineSide, after(x), y)]);
  Level out(static_cast<size_t>(side) * static_cast<size_t>(side));
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      out[indexOf(side, x, y)] =
          0.5F * rows[indexOf(side, x, 2 * y)] +
          0.25F * (rows[indexOf(side, x, before(y))] + rows[indexOf(side, x, after(y))]);
  return out;
}

constexpr size_t samplesOfSide() {
  size_t sum = 0;
  for (int level = 0; level < kGradientLevels; ++level) sum += static_cast<size_t>(gradientSide(level));
  return sum;
}

}  // namespace

BorderGradients::BorderGradients() : values_(4 * samplesOfSide()) {}

size_t BorderGradients::offset(Side side, int level) {
  size_t out = static_cast<size_t>(side) * samplesOfSide();
  for (int l = 0; l < level; ++l) out += static_cast<size_t>(gradientSide(l));
  return out;
}

PackedGradient packGradient(Gradient sum) {
  if (sum.weight <= 0.0F) return 0;
  return halfFromFloat(sum.x / sum.weight) | halfFromFloat(sum.y / sum.weight) << 16;
}

TileShading makeTileShading(const std::vector<float>& heights, const Coverage& coverage) {
  TERRANE_CHECK(heights.size() == static_cast<size_t>(kTileSampleCount), "{} heights", heights.size());
  TileShading out;
  out.atlas.resize(static_cast<size_t>(kAtlasWidth) * kAtlasHeight);
  Level gradients = gradientsAtSamples(gradientsOfCells(heights, coverage));
  for (int level = 0; level < kGradientLevels; ++level) {
    const int side = gradientSide(level);
    if (level > 0) gradients = halve(gradients, gradientSide(level - 1));
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x)
        out.atlas[indexOf(kAtlasWidth, atlasX(level) + x, atlasY(level) + y)] =
            packGradient(gradients[indexOf(side, x, y)]);
    for (int i = 0; i < side; ++i) {
      out.borders.at(Side::North, level, i) = gradients[indexOf(side, i, 0)];
      out.borders.at(Side::South, level, i) = gradients[indexOf(side, i, side - 1)];
      out.borders.at(Side::West, level, i) = gradients[indexOf(side, 0, i)];
      out.borders.at(Side::East, level, i) = gradients[indexOf(side, side - 1, i)];
    }
  }
  return out;
}

}  // namespace terrane
