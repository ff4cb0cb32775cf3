#pragma once

#include <cmath>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "terrane/tiling/tile_id.h"

namespace terrane {

/// Where a dataset's lattice lies on the ground: the one place that knows how samples, the dataset's CRS
/// and local metres relate.
///
/// - *CRS coordinates*: easting, northing in the units of the dataset's projected CRS; height in metres.
/// - *local coordinates*: metres, x east, y north, z up; (0, 0) is the world's north-west corner, so the
///   world lies at x >= 0, y <= 0. Right-handed. Heights are the same as in CRS coordinates.
/// - *sample coordinates*: finest data level's samples, x east, y **south**, (0, 0) the north-west corner.
struct Frame {
  double originEasting = 0.0;   ///< CRS easting of the sample (0, 0)
  double originNorthing = 0.0;  ///< CRS northing of the sample (0, 0)
  double spacingX = 1.0;        ///< CRS units between samples of the finest data level, along x
  double spacingY = 1.0;        ///< the same along y, positive; within one per cent of spacingX in metres
  double metersPerUnit = 1.0;   ///< of the CRS
  int finestLevel = 0;          ///< the deepest level that holds data

  double spacingXMeters() const { return spacingX * metersPerUnit; }
  double spacingYMeters() const { return spacingY * metersPerUnit; }
  /// Cells along the world's side at the finest data level.
  int64_t worldCells() const { return static_cast<int64_t>(kTileCells) << finestLevel; }

  glm::dvec3 localFromCrs(glm::dvec3 crs) const {
    return {(crs.x - originEasting) * metersPerUnit, (crs.y - originNorthing) * metersPerUnit, crs.z};
  }
  glm::dvec3 crsFromLocal(glm::dvec3 local) const {
    return {local.x / metersPerUnit + originEasting, local.y / metersPerUnit + originNorthing, local.z};
  }
  glm::dvec2 localFromSample(glm::dvec2 sample) const {
    return {sample.x * spacingXMeters(), -sample.y * spacingYMeters()};
  }
  glm::dvec2 sampleFromLocal(glm::dvec2 local) const {
    return {local.x / spacingXMeters(), -local.y / spacingYMeters()};
  }
};

}  // namespace terrane
