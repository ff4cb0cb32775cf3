#pragma once

#include <array>
#include <string>
#include <vector>

#include "input_raster.h"
#include "terrane/bake/source.h"
#include "terrane/base/result.h"
#include "warp.h"

namespace terrane {

/// One input on the dataset's lattice, at its native level.
struct PlacedInput {
  InputRaster raster;
  bool warped = false;
  WarpKernel kernel;  ///< where warped
  int coarser = 0;    ///< levels above the finest
  int nativeLevel = 0;

  /// The samples of its native level that it may have, as a rectangle of that level's lattice.
  int64_t firstCol = 0;
  int64_t firstRow = 0;
  int64_t cols = 0;
  int64_t rows = 0;

  /// Only sample by sample: the raster's columns run west, its rows run north.
  bool mirroredX = false;
  bool mirroredY = false;
};

/// The plan and what stands behind it.
struct PlacedSource {
  SourcePlan plan;
  std::vector<PlacedInput> inputs;  ///< bottom to top
  double largestHeight = 0.0;       ///< |height| that the height step can hold
  /// GDAL's geotransform of a level's lattice: pixel edges around its samples.
  std::array<double, 6> geoTransform(int level) const;
};

/// Lays described inputs on one lattice and chooses the height step (issue 2, section 3); reads no samples.
Result<PlacedSource> placeInputs(std::vector<InputRaster> inputs, const SourceOptions& options,
                                 Progress& progress);

/// Lays described inputs on the lattice of a dataset that is lossless, with all its samples on one level. The
/// plan has the dataset's lattice, widened, and the records of these inputs only. `directory` names the
/// dataset. Errors: what does not fall on it sample by sample.
Result<PlacedSource> placeOnto(std::vector<InputRaster> inputs, const Manifest& base,
                               const std::string& directory);

}  // namespace terrane
