#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "terrane/tiling/tile_id.h"

namespace terrane {

/// A tile of one of a dataset's layers.
struct TileKey {
  static constexpr int32_t kElevation = -1;

  int32_t layer = kElevation;  ///< or a position in the manifest's imagery
  TileId tile;

  bool isElevation() const { return layer == kElevation; }
  TileKey parent() const { return {layer, tile.parent()}; }
  friend bool operator==(const TileKey&, const TileKey&) = default;
  friend auto operator<=>(const TileKey&, const TileKey&) = default;
};

struct TileKeyHash {
  size_t operator()(const TileKey& key) const {
    const uint64_t mixed = static_cast<uint64_t>(key.layer + 1) * 0x9e3779b97f4a7c15ULL;
    return TileIdHash{}(key.tile) ^ static_cast<size_t>(mixed);
  }
};

}  // namespace terrane
