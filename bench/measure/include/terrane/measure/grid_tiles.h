#pragma once

#include <cstdint>
#include <memory>
#include <unordered_map>

#include "terrane/base/result.h"
#include "terrane/dataset/dataset.h"
#include "terrane/lod/select_patches.h"
#include "terrane/tiling/camera.h"

namespace terrane {

/// All stored tiles of a dataset, decoded: everything is resident. About 330 kB a tile.
class AllTiles final : public ResidentTiles {
 public:
  static Result<AllTiles> load(const Dataset& dataset);
  const Tile* find(TileId id) const override;

 private:
  std::unordered_map<TileId, std::unique_ptr<Tile>, TileIdHash> tiles_;
};

/// What a uniform grid-per-tile level of detail draws for one camera.
struct GridTilesCost {
  int64_t tiles = 0;
  int64_t triangles = 0;
};

/// The classic that `patches` is compared with: a quadtree of tiles, each drawn as its whole grid of
/// 2 * 256 * 256 triangles, refined where its error on screen exceeds `tauPixels`, culled against the
/// frustum. It has the same error data (of a tile: the largest code of its diamonds whose patches show all
/// its samples) and the same metric on the tile's box. In its favour: a quadrant of which nothing is stored
/// counts as a quarter of a grid, and what it would need against cracks between levels counts nothing.
GridTilesCost selectGridTiles(const AllTiles& tiles, const Frame& frame, const ElevationScale& scale,
                              const Camera& camera, double tauPixels);

}  // namespace terrane
