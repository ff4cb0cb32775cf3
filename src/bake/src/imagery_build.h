#pragma once

#include <string>

#include "imagery_plan.h"
#include "terrane/base/progress.h"
#include "terrane/base/result.h"
#include "workers.h"

namespace terrane {

/// Four tiles as their parent: alpha is the mean, rounded up; colours are means weighted by alpha.
/// `child` quadrants that are null are transparent.
ImageryTile halveImagery(const std::array<const ImageryTile*, 4>& children);

/// Lays `below` under `tile`.
void layUnder(ImageryTile& tile, const ImageryTile& below);

/// One tile of a layer's finest level from its pictures: a job that may run anywhere, any number of times.
Status readFinestImagery(std::vector<std::unique_ptr<PictureSampler>>& samplers, const PlannedLayer& layer,
                         const ImageryFrame& frame, TileId id, ImageryTile& out);

/// Builds a layer: reads its finest level tile by tile, makes each coarser one from the one before, codes
/// every tile as it is made, and at last writes the archive `folder`/record.archive. Memory: `memoryBytes`
/// and a few tiles a worker; what does not fit goes to scratch files in `folder`. Returns the finished
/// record.
Result<ImageryLayerRecord> buildImageryLayer(const ImageryPlan& plan, const PlannedLayer& layer,
                                             const std::string& folder, uint64_t memoryBytes,
                                             const Workers& workers, Progress& progress);

/// All layers, and what the manifest says of them and of their archives.
Status buildImagery(const ImageryPlan& plan, const std::string& folder, uint64_t memoryBytes,
                    const Workers& workers, Progress& progress, Manifest& manifest);

}  // namespace terrane
