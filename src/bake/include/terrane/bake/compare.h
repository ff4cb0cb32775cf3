#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "terrane/base/progress.h"
#include "terrane/base/result.h"
#include "terrane/dataset/dataset.h"

namespace terrane {

/// What to know of the rasters beyond what the dataset's manifest records. The manifest's record of an input
/// (found by its hash, else by its name, else by its place in the list) holds where nothing is said here.
struct CompareOptions {
  std::string sourceCrs;         ///< --source-crs: of the rasters, where the manifest does not tell
  std::optional<double> noData;  ///< --nodata
  int threads = 0;               ///< 0: all cores
  const std::atomic<bool>* cancel = nullptr;  ///< once true, the work ends soon with an error
};

/// How a dataset's finest samples differ from the rasters it was built from.
/// A warped raster's samples at their own places, against the surface: what lies between the dataset's
/// samples is not in its bound.
struct OwnSamples {
  uint64_t compared = 0;  ///< of the raster's, evenly spread
  double largestMeters = 0.0;
  double meanMeters = 0.0;
  double largestEasting = 0.0;  ///< where the largest is, in the dataset's CRS
  double largestNorthing = 0.0;
};

struct ComparisonReport {
  uint64_t compared = 0;        ///< samples with a height on both sides
  uint64_t onlyInSource = 0;    ///< void in the dataset only
  uint64_t onlyInDataset = 0;   ///< void in the rasters only
  uint64_t interpolated = 0;    ///< left out: between the samples of a coarser raster
  double largestMeters = 0.0;   ///< largest |dataset - source|
  double meanMeters = 0.0;      ///< mean of |dataset - source|
  double largestEasting = 0.0;  ///< where the largest is, in the dataset's CRS
  double largestNorthing = 0.0;
  double boundMeters = 0.0;  ///< what the manifest states; 0 for lossless
  /// Some raster was warped, and compared as it was warped: between its own samples, not at them.
  bool isWarped = false;
  std::optional<OwnSamples> ownSamples{};  ///< of a raster that was warped and is the only one

  bool withinBound() const { return largestMeters <= boundMeters; }
  bool sameVoids() const { return onlyInSource == 0 && onlyInDataset == 0; }
  /// Something was compared, and all of it holds.
  bool agrees() const { return compared > 0 && withinBound() && sameVoids(); }
};

/// Reads the source of a dataset again and compares, sample by sample, on the dataset's grid. `rasters` are
/// named as for a build (files, folders, globs, @lists), the last on top. The way to the source is not the
/// build's: samples come straight from each raster, warped ones from GDALWarp() with the settings that the
/// manifest records. Cost: the source read, and the dataset decoded, once; memory does not grow with either.
/// Errors: an unreadable raster or tile, a raster that cannot be laid on the dataset's grid.
Result<ComparisonReport> compareWithSource(const Dataset& dataset, const std::vector<std::string>& rasters,
                                           const CompareOptions& options, Progress& progress);

}  // namespace terrane
