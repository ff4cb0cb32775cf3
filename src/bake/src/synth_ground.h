#pragma once

#include <cstdint>
#include <vector>

#include "synth_world.h"

namespace terrane::synth {

enum class Water : uint8_t { kNone, kRiver, kLake, kSea };

/// A rectangle of samples, row by row from the north-west.
struct GroundTile {
  int cols = 0;
  int rows = 0;
  std::vector<float> height;  ///< metres, steps of 1/256; the water's surface where there is water
  std::vector<Water> water;
  std::vector<float> depth;     ///< metres of water
  std::vector<float> flatness;  ///< World::flatness
};

/// A world at full detail: the coarse shape, bent a little everywhere, with carved river beds and gullies
/// that run down the slopes.
class Ground {
 public:
  /// `world` must outlive this.
  Ground(const World& world, double spacingMeters);
  /// Samples [col0, col0 + cols) x [row0, row0 + rows); (0, 0) is the world's centre, rows count south.
  /// The same sample gets the same bits in every rectangle that holds it.
  void evaluate(int64_t col0, int64_t row0, int cols, int rows, GroundTile& tile) const;

  double spacingMeters() const { return spacing_; }
  uint32_t seed() const { return world_.seed; }

 private:
  const World& world_;
  double spacing_;
  double centreX_;
  double centreY_;
};

}  // namespace terrane::synth
