#pragma once

#include <memory>
#include <vector>

#include "source_plan.h"
#include "terrane/bake/source.h"
#include "terrane/base/progress.h"

/// The steps of opening rasters as a source.
namespace terrane {

inline constexpr size_t kMaxInputs = 65535;  ///< ranks are 16 bits

/// Looks at all inputs; each has a CRS. Errors name the file.
Result<std::vector<InputRaster>> describeRasters(const SourceOptions& options, Progress& progress);

/// Fills in the hashes of source.plan.inputs, which are those of source.inputs.
Status hashInputs(PlacedSource& source, Progress& progress);

/// A source of placed and hashed rasters.
std::unique_ptr<Source> makeRasterSource(PlacedSource source);

}  // namespace terrane
