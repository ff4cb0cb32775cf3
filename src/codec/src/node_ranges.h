#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "terrane/codec/tile.h"

namespace terrane {

/// What a tile's samples and child states let one expect of its nodes' height ranges, node by node from the
/// finest level up. Encoder and decoder ask
/// the same questions in the same order; only the differences are stored.
class RangePredictor {
 public:
  struct Range {
    uint16_t low = 65535;
    uint16_t high = 0;
  };

  /// All but `nodes` must be complete; both are kept by reference.
  RangePredictor(const Tile& tile, const TileNodes& nodes, const ElevationScale& scale);

  /// Is there a finer tile under a quad of the finest node level?
  bool isRefined(const NodePlace& quad) const;
  /// Of a quad of the finest node level: the ground under it, and what finer tiles may add around.
  Range ofSamples(const NodePlace& quad) const;
  /// Of any other node: what its children in the tile have; -1 where there is none.
  Range ofChildren(const std::array<int16_t, 4>& children) const;

 private:
  const Tile& tile_;
  const TileNodes& nodes_;
  const ElevationScale& scale_;
  std::vector<float> blockLow_;  ///< lowest ground in each block of 8 x 8 cells; +inf: none
  std::vector<float> blockHigh_;
};

}  // namespace terrane
