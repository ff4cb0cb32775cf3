#pragma once

#include <list>
#include <memory>
#include <vector>

#include "terrane/codec/all_layers.h"
#include "terrane/dataset/dataset.h"

namespace terrane {

/// A tile of a dataset.
struct StoredTile {
  TileId id;
  TilePayloads payloads;  ///< empty: not stored, and only tile.samples is of use
  Tile tile;              ///< with all layers
};

/// Reads a dataset's tiles for one thread, and keeps the last ones, since each needs its ancestors.
class StoredTiles {
 public:
  /// The dataset must outlive this.
  explicit StoredTiles(const Dataset& dataset) : dataset_(dataset) {}

  /// A tile of any level up to the finest. Where it is not stored, its samples are those that the dataset was
  /// built from all the same: whatever interpolation would not have given back was stored. Errors: the
  /// dataset's, with the tile's name.
  Result<std::shared_ptr<const StoredTile>> read(TileId id);

 private:
  static constexpr size_t kKept = 32;  ///< some 12 MB, and more than a chain of ancestors

  const Dataset& dataset_;
  std::list<std::shared_ptr<const StoredTile>> kept_;  ///< last used first
};

}  // namespace terrane
