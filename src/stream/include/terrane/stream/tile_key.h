#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "terrane/tiling/tile_id.h"

namespace terrane {

/// A tile of one of a dataset's layers: of imagery, or of the elevation, which may come in layers of
/// significance (ElevationScale::layerCount).
struct TileKey {
  static constexpr int32_t kElevation = -1;

  /// A position in the manifest's imagery, or -1 - j: the elevation's layer of significance j.
  int32_t layer = kElevation;
  TileId tile;

  static TileKey elevation(TileId tile, int significance = 0) { return {kElevation - significance, tile}; }
  bool isElevation() const { return layer < 0; }
  /// Does it add to what other layers of the elevation have?
  bool isRefinement() const { return layer < kElevation; }
  /// Only of elevation: which of its layers of significance.
  int significance() const { return kElevation - layer; }
  TileKey parent() const { return {layer, tile.parent()}; }
  /// Only of a refinement: what it adds to, the same tile in the layer before.
  TileKey before() const { return {layer + 1, tile}; }
  friend bool operator==(const TileKey&, const TileKey&) = default;
  friend auto operator<=>(const TileKey&, const TileKey&) = default;
};

struct TileKeyHash {
  size_t operator()(const TileKey& key) const {
    // note: below -1 this wraps around, and is as good a multiple.
    const uint64_t mixed = static_cast<uint64_t>(int64_t{key.layer} + 1) * 0x9e3779b97f4a7c15ULL;
    return TileIdHash{}(key.tile) ^ static_cast<size_t>(mixed);
  }
};

}  // namespace terrane
