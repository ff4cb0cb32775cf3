#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "terrane/dataset/manifest.h"
#include "terrane/lod/select_patches.h"
#include "terrane/tiling/camera.h"

namespace terrane {

/// An imagery tile that a picture reads.
struct ImageryNeed {
  TileId tile;
  double texelPixels = 0.0;  ///< about the size on screen of its nearest texel
  double areaPixels = 0.0;   ///< about as much of the picture it covers
};

/// What the choice depends on.
struct ImageryView {
  const Camera& camera;
  double exaggeration;  ///< of the camera's world
  const Manifest& manifest;
  const ResidentTiles& heights;  ///< tell how high the ground is
  std::function<bool(TileId)> hasDeeper;  ///< is there a picture below a tile?
};

/// The imagery tiles that a camera needs so that a texel covers at most a pixel, ancestors included, by
/// address (so coarse ones first). Where that would be more than `most`, texels are larger. A pure function.
std::vector<ImageryNeed> selectImagery(const ImageryView& view, size_t most);

}  // namespace terrane
