#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

/// Square tiles of heights made up at random, some with holes.
namespace terrane {

struct RandomHeightsOptions {
  double slopeMeters = 50.0;  ///< of waves across the tile
  double noiseMeters = 1.0;   ///< of each sample
  double cliffMeters = 0.0;   ///< north of a line the ground is so much higher
  double voidShare = 0.0;     ///< of the samples, in blocks of 4 x 4
};

inline std::vector<float> randomHeights(int side, const RandomHeightsOptions& options, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double phaseX = 6.0 * unit(random);
  const double phaseY = 6.0 * unit(random);
  const double cliffAt = unit(random) * side;
  const auto blocks = static_cast<size_t>(side / 4 + 1);
  std::vector<uint8_t> isVoid(blocks * blocks, 0);
  for (uint8_t& block : isVoid) block = unit(random) < options.voidShare ? 1 : 0;

  std::vector<float> heights;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double wave = std::sin(phaseX + 9.0 * x / side) * std::cos(phaseY + 7.0 * y / side);
      const double cliff = y + 0.3 * x < cliffAt ? options.cliffMeters : 0.0;
      const double height = options.slopeMeters * wave + options.noiseMeters * (unit(random) - 0.5) + cliff;
      const size_t block = static_cast<size_t>(y / 4) * blocks + static_cast<size_t>(x / 4);
      heights.push_back(isVoid[block] != 0 ? std::numeric_limits<float>::quiet_NaN()
                                           : static_cast<float>(height));
    }
  }
  return heights;
}

/// Another kind of tile for each number: calm, rough, with cliffs, with holes.
inline std::vector<float> randomHeights(int side, unsigned seed) {
  std::mt19937 random(seed);
  RandomHeightsOptions options;
  options.slopeMeters = seed % 5 == 0 ? 0.0 : 40.0;
  options.noiseMeters = seed % 3 == 0 ? 0.1 : 3.0;
  options.cliffMeters = seed % 4 == 0 ? 60.0 : 0.0;
  options.voidShare = seed % 7 == 0 ? 0.4 : 0.0;
  return randomHeights(side, options, random);
}

}  // namespace terrane
