#include "tile_shading.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace terrane {
namespace {

float floatFromHalf(uint32_t half) {
  const int exponent = static_cast<int>(half >> 10 & 31U);
  const auto fraction = static_cast<float>(half & 1023U);
  const float magnitude =
      exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1024.0F + fraction, exponent - 25);
  return (half & 0x8000U) != 0 ? -magnitude : magnitude;
}

Gradient gradientAt(const TileShading& shading, int level, int x, int y) {
  const size_t at =
      static_cast<size_t>(atlasY(level) + y) * kAtlasWidth + static_cast<size_t>(atlasX(level) + x);
  return {floatFromHalf(shading.atlas[at] & 0xffffU), floatFromHalf(shading.atlas[at] >> 16)};
}

const Coverage kAllGround{.kind = Coverage::Kind::Full, .bits = {}};

TEST(TileShading, PacksHalvesToTheNearest) {
  for (const float value : {0.0F, 1.0F, -1.0F, 0.333F, -7.77F, 1e-3F, 3e-5F, -2e-6F, 65504.0F, 1234.5F}) {
    const float back = floatFromHalf(packGradient({value, 0.0F, 1.0F}) & 0xffffU);
    EXPECT_NEAR(back, value, std::max(std::abs(value) / 2048.0F, 0x1p-25F)) << value;
  }
  EXPECT_EQ(floatFromHalf(packGradient({0.0F, 1e9F, 1.0F}) >> 16), 65504.0F);
}

TEST(TileShading, APlaneHasItsGradientEverywhere) {
  std::vector<float> heights;
  for (int y = 0; y < kTileSamples; ++y)
    for (int x = 0; x < kTileSamples; ++x)
      heights.push_back(100.0F + 0.5F * static_cast<float>(x) - 0.25F * static_cast<float>(y));
  const TileShading shading = makeTileShading(heights, kAllGround);
  for (int level = 0; level < kGradientLevels; ++level)
    for (int y = 0; y < gradientSide(level); ++y)
      for (int x = 0; x < gradientSide(level); ++x) {
        EXPECT_EQ(gradientAt(shading, level, x, y).x, 0.5F);
        EXPECT_EQ(gradientAt(shading, level, x, y).y, -0.25F);
      }
}

TEST(TileShading, BordersOfNeighboursAverageToTheUndividedGround) {
  // One tile's interior seen as two tiles' shared border: a wide strip of random ground, cut in two.
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0.0F, 100.0F);
  const int wide = 2 * kTileCells + 1;
  std::vector<float> ground(static_cast<size_t>(wide) * kTileSamples);
  for (float& h : ground) h = uniform(random);
  const auto cut = [&](int fromX) {
    std::vector<float> heights;
    for (int y = 0; y < kTileSamples; ++y)
      for (int x = 0; x < kTileSamples; ++x)
        heights.push_back(ground[static_cast<size_t>(y * wide + fromX + x)]);
    return makeTileShading(heights, kAllGround);
  };
  const TileShading west = cut(0);
  const TileShading east = cut(kTileCells);
  const TileShading across = cut(kTileCells / 2);
  for (int level = 0; level < kGradientLevels; ++level) {
    const int side = gradientSide(level);
    for (int i = 0; i < side; ++i) {
      const Gradient a = west.borders.at(Side::East, level, i);
      const Gradient b = east.borders.at(Side::West, level, i);
      const Gradient whole = gradientAt(across, level, side / 2, i);
      EXPECT_NEAR((a.x + b.x) / (a.weight + b.weight), whole.x, 0.02F) << level << " " << i;
      EXPECT_NEAR((a.y + b.y) / (a.weight + b.weight), whole.y, 0.02F) << level << " " << i;
    }
  }
}

TEST(TileShading, HolesDoNotCount) {
  // A plane with a deep hole: wherever a cell is ground, its samples tell the plane's gradient on every
  // level.
  std::vector<float> heights;
  Coverage coverage{.kind = Coverage::Kind::Partial, .bits = std::vector<uint8_t>(Coverage::kBytes, 0)};
  const auto ground = [](int x, int y) {
    return (x - 100) * (x - 100) + (y - 90) * (y - 90) > 1600 && x + y > 60;
  };
  for (int y = 0; y < kTileSamples; ++y)
    for (int x = 0; x < kTileSamples; ++x) {
      const bool touchesGround = ground(x, y) || ground(x - 1, y) || ground(x, y - 1) || ground(x - 1, y - 1);
      heights.push_back(touchesGround ? 0.5F * static_cast<float>(x) : -5000.0F);
    }
  for (int cell = 0; cell < kTileCellCount; ++cell)
    if (ground(cell % kTileCells, cell / kTileCells))
      coverage.bits[static_cast<size_t>(cell / 8)] =
          static_cast<uint8_t>(coverage.bits[static_cast<size_t>(cell / 8)] | 1U << cell % 8);
  const TileShading shading = makeTileShading(heights, coverage);
  for (int level = 0; level < kGradientLevels; ++level)
    for (int y = 0; y < kTileCells; ++y)
      for (int x = 0; x < kTileCells; ++x) {
        if (!ground(x, y)) continue;
        for (const int dy : {0, 1})
          for (const int dx : {0, 1}) {
            const Gradient gradient = gradientAt(shading, level, (x >> level) + dx, (y >> level) + dy);
            ASSERT_FLOAT_EQ(gradient.x, 0.5F) << level << " " << x << " " << y;
            ASSERT_FLOAT_EQ(gradient.y, 0.0F);
          }
      }
}

}  // namespace
}  // namespace terrane
