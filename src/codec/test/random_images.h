#pragma once

#include <algorithm>
#include <cmath>
#include <random>

#include "terrane/codec/imagery_codec.h"

namespace terrane {

/// A picture with soft and sharp parts; with `holes`, a part of it is transparent and an edge half so.
inline ImageryTile randomImage(uint32_t seed, bool holes) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double a = unit(random), b = unit(random), c = unit(random);
  ImageryTile tile;
  for (int y = 0; y < kImageryTileSide; ++y) {
    for (int x = 0; x < kImageryTileSide; ++x) {
      const double u = x / 256.0, v = y / 256.0;
      const double field = ((x / 24 + y / 40) & 1) != 0 ? 25.0 : -25.0;
      const double grain = 8.0 * (unit(random) - 0.5);
      uint8_t* texel = &tile.rgba[static_cast<size_t>(y * kImageryTileSide + x) * 4];
      const auto byte = [](double value) { return static_cast<uint8_t>(std::clamp(value, 0.0, 255.0)); };
      texel[0] = byte(120.0 + 60.0 * std::sin(9.0 * u + 6.0 * a) + field + grain);
      texel[1] = byte(130.0 + 50.0 * std::sin(7.0 * v + 6.0 * b) + field + grain);
      texel[2] = byte(100.0 + 50.0 * std::cos(8.0 * (u + v) + 6.0 * c) - 0.4 * field + grain);
      const double inside = 100.0 - std::hypot(x - 90.0, y - 140.0);
      texel[3] = holes ? byte(inside > 2.0 ? 255.0 : inside < -2.0 ? 0.0 : 128.0) : 255;
    }
  }
  return tile;
}

}  // namespace terrane
