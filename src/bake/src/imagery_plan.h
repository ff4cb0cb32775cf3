#pragma once

#include <vector>

#include "imagery_sampler.h"
#include "terrane/bake/imagery.h"

namespace terrane {

/// One layer, before its first pixel is read for good.
struct PlannedLayer {
  ImageryLayerRecord record;            ///< all but what the build finds out
  std::vector<PlacedPicture> pictures;  ///< bottom to top
  /// The tiles of its finest level that a picture may touch, in the order of jobs: row by row.
  std::vector<TileId> finestTiles;
};

struct ImageryPlan {
  ImageryFrame frame;
  ImageryFormat format = kDefaultImageryFormat;
  int quality = defaultImageryQuality(kDefaultImageryFormat);
  std::vector<PlannedLayer> layers;
};

}  // namespace terrane
