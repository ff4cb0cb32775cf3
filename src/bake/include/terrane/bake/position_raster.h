#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <string>

#include "terrane/base/result.h"

namespace terrane {

/// Writes what stands under each pixel of a picture: a GeoTIFF of three float64 bands (easting, northing,
/// height; NaN for sky), rows from the top, width * height points. The raster has the picture's geometry, not
/// the ground's; the CRS of the coordinates stands in the metadata item COORDINATES_CRS. Written aside and
/// renamed. Errors: the path cannot be written.
Status writePositionRaster(const std::string& path, int width, int height,
                           std::span<const glm::dvec3> positionsCrs, const std::string& crsWkt);

}  // namespace terrane
