#pragma once

#include <vector>

#include "terrane/codec/tile.h"

namespace terrane {

/// What a tile's samples and child states let one expect of its nodes' height ranges, node by node from the
/// finest level up: expect() of a node needs the ranges of its children in the tile. Encoder and decoder ask
/// the same questions in the same order; only the differences are stored.
class RangePredictor {
 public:
  struct Range {
    uint16_t low = 65535;
    uint16_t high = 0;
  };

  /// All but `nodes` must be complete; both are kept by reference.
  RangePredictor(const Tile& tile, const TileNodes& nodes, const ElevationScale& scale, bool isRoot);

  /// Quads of the finest node level: the ground under them, and what finer tiles may add around.
  /// All others: what their children in the tile have.
  Range expect(const NodePlace& place) const;
  /// Is there a finer tile under a quad of the finest node level?
  bool isRefined(const NodePlace& quad) const;

 private:
  Range ofSamples(const NodePlace& quad) const;
  Range ofChildren(const NodePlace& place) const;

  const Tile& tile_;
  const TileNodes& nodes_;
  const ElevationScale& scale_;
  bool isRoot_;
  std::vector<float> blockLow_;  ///< lowest ground in each block of 8 x 8 cells; +inf: none
  std::vector<float> blockHigh_;
};

}  // namespace terrane
