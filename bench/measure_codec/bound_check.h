#pragma once

#include <vector>

#include "source_tiles.h"
#include "stored_pyramid.h"

namespace terrane {

/// How a dataset's finest samples keep to what they were made from.
struct BoundCheck {
  int64_t samples = 0;     ///< compared
  int64_t violations = 0;  ///< further off than the bound, or void on one side only
  double largestMeters = 0.0;
};

/// Compares every sample of the source, also where the dataset stores no tile. The bound is the manifest's
/// and holds for the floats as they are: a build keeps room for their rounding.
Result<BoundCheck> checkBound(const StoredPyramid& pyramid, const std::vector<SourceTile>& source);

/// The addresses of the source's tiles.
std::vector<TileId> addressesOf(const std::vector<SourceTile>& source);

}  // namespace terrane
