#pragma once

#include <atomic>

#include "input_raster.h"
#include "terrane/bake/compare.h"
#include "terrane/base/progress.h"
#include "terrane/base/result.h"
#include "terrane/dataset/dataset.h"

namespace terrane {

/// How far a dataset's surface is from the samples of a raster that was warped for it, at their own places:
/// what a surface between samples loses of them is not in the dataset's bound. Up to a million samples,
/// evenly over the raster; those that fall beside the ground are left out. Errors: the raster, the dataset, a
/// way between their CRSs that GDAL does not know.
Result<OwnSamples> compareOwnSamples(const Dataset& dataset, const InputRaster& raster,
                                     const std::atomic<bool>* cancel, Progress& progress);

}  // namespace terrane
