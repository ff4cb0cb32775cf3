#pragma once

#include <string>

#include "block_store.h"
#include "imagery_plan.h"
#include "jobs.h"
#include "terrane/base/progress.h"
#include "terrane/base/result.h"

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
/// every tile as it is made, and at last writes the archive `path`. What lies between the steps goes to
/// `scratch`; memory is a few tiles a worker. Returns the finished record;
/// without a tile, and without an archive, where no picture has a texel over the elevation.
Result<ImageryLayerRecord> buildImageryLayer(const ImageryPlan& plan, const PlannedLayer& layer,
                                             const std::string& path, const Scratch& scratch, Jobs& jobs,
                                             Progress& progress);

/// All that shapes the layers, as text, and the most that building them takes on the disk, about.
std::string describeImageryPlan(const ImageryPlan& plan);
uint64_t roomForImagery(const ImageryPlan& plan);

}  // namespace terrane
