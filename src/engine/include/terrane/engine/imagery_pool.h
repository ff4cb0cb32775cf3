#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/imagery_codec.h"
#include "terrane/dataset/dataset.h"
#include "terrane/engine/tile_pool.h"
#include "terrane/tiling/camera.h"

namespace terrane {

/// The imagery of a dataset as one picture: its layers laid over each other, tile by tile. One thread at a
/// time.
class ImageryPool {
 public:
  /// `dataset` must outlive the pool. `layers` are positions in its manifest's imagery, bottom to top.
  ImageryPool(const Dataset& dataset, const std::vector<size_t>& layers);

  /// The tiles that a camera needs so that a texel covers at most a pixel, ancestors included, coarse ones
  /// first. Where that would be more than kMostTiles, texels may be larger. `exaggeration` is the camera's
  /// world's; `heights` tell how high the ground is.
  static constexpr size_t kMostTiles = 1000;
  std::vector<TileId> tilesFor(const Camera& camera, double exaggeration, const TilePool& heights) const;

  /// Reads what is not here yet, together, decodes it and lays it over each other, on all cores. Tiles that
  /// are not in `ids` may be forgotten.
  Status load(std::span<const TileId> ids);
  /// A tile that was loaded, or null where there is no picture.
  const ImageryTile* find(TileId id) const;
  /// The tile with one texel of border around it, from the neighbours that are here: 258 x 258 texels. Empty
  /// where there is no picture.
  std::vector<uint8_t> bordered(TileId id) const;

  bool empty() const { return layers_.empty(); }
  uint64_t bytesRead() const { return bytesRead_; }

 private:
  struct Layer {
    size_t index = 0;
    int finestLevel = 0;
    std::vector<TileId> tiles;  ///< ascending
    bool has(TileId id) const;
    /// The tile itself or, beyond the layer's finest level, its ancestor there.
    TileId storedFor(TileId id) const;
  };
  /// Stored tiles of a layer, as bytes.
  using Payloads = std::unordered_map<TileId, std::vector<uint8_t>, TileIdHash>;
  bool hasDeeper(TileId id) const;
  /// What the tiles need of each layer.
  Result<std::vector<Payloads>> readFor(std::span<const TileId> ids);
  Result<std::unique_ptr<ImageryTile>> make(TileId id, const std::vector<Payloads>& payloads) const;

  const Dataset* dataset_;
  std::vector<Layer> layers_;
  std::unordered_map<TileId, std::unique_ptr<ImageryTile>, TileIdHash> tiles_;  ///< null: no picture
  uint64_t bytesRead_ = 0;
};

}  // namespace terrane
