#pragma once

#include <cstdint>

#include "terrane/base/result.h"
#include "terrane/dataset/dataset.h"
#include "terrane/reference/reference_surface.h"

namespace terrane {

struct ReferenceOptions {
  /// The most that the surface may take, about 5.5 bytes a sample of the dataset's extent.
  uint64_t memoryBytes = 4000000000;
};

/// Decodes the finest level of a dataset, tiles that are not stored interpolated from their parents. Errors:
/// a tile that cannot be read or decoded; an extent that does not fit into `memoryBytes`.
Result<ReferenceSurface> loadReference(const Dataset& dataset, const ReferenceOptions& options = {});

/// The margin for ReferenceSurface::Cover that holds whatever tiles are loaded: two cells of the root tile.
int64_t coarsestCellMargin(const Frame& frame);

}  // namespace terrane
