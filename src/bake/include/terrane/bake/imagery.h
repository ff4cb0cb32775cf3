#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrane/base/progress.h"
#include "terrane/base/result.h"
#include "terrane/codec/imagery_codec.h"
#include "terrane/dataset/manifest.h"

namespace terrane {

/// Pictures that lie over the terrain as one layer.
struct ImageryLayerOptions {
  std::string name = "imagery";  ///< letters, digits, '-' and '_'; of its archive and in the manifest
  /// Files, folders, globs or @lists as for elevation; later ones lie on top. "A+B+C" is one picture whose
  /// bands are those of A, then B's, then C's, on one grid.
  std::vector<std::string> inputs;
  /// Which bands are red, green and blue, counted from 1; one band is grey, a fourth is alpha. Empty: what
  /// the file says.
  std::vector<int> bands;
  /// The values that become black and white. Nothing: 8-bit values as they are, for others the 2nd and 98th
  /// percentile of each band over all the layer's pictures.
  std::optional<std::array<double, 2>> stretch;
  std::optional<double> noData;  ///< overrides what the files say
  std::string sourceCrs;         ///< of pictures without a CRS or with a wrong one
  std::string attribution;
};

struct ImageryOptions {
  std::vector<ImageryLayerOptions> layers;       ///< bottom to top
  ImageryFormat format = kDefaultImageryFormat;  ///< of all tiles but the root, which is JPEG
  int quality = defaultImageryQuality(kDefaultImageryFormat);
};

/// Opened, checked and placed pictures; what build needs, and no more.
struct ImageryPlan;

/// The frame that pictures are brought into.
struct ImageryFrame {
  std::string crsWkt;
  Frame frame;
  int64_t extentCols = 0;  ///< samples of the finest elevation level that can be ground
  int64_t extentRows = 0;
};

/// Opens, checks and places all pictures, hashes their files and finds the stretches; reads no more than an
/// overview of them. Errors name the file and the remedy.
Result<std::shared_ptr<const ImageryPlan>> planImagery(const ImageryOptions& options,
                                                       const ImageryFrame& frame, Progress& progress);

}  // namespace terrane
