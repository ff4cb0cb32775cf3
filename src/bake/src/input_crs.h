#pragma once

#include <ogr_spatialref.h>

#include <optional>
#include <span>
#include <string>

#include "input_raster.h"
#include "terrane/base/result.h"

namespace terrane {

/// A CRS from what a user typed (EPSG:32632, WKT, PROJ, a file); x before y, vertical part dropped.
/// `option` names the flag in the error.
Result<OGRSpatialReference> crsFromUser(const std::string& text, const std::string& option);

/// Do two CRSs give every point the same coordinates? Names and TOWGS84 hints do not matter.
bool sameCrs(const OGRSpatialReference& a, const OGRSpatialReference& b);

/// The dataset's CRS: `crs` where given; else the inputs' own where they are all in the same projected one;
/// else the UTM zone at the middle of them all, on their own geographic CRS if they share it. Beyond 84 N
/// and 80 S polar stereographic; on other bodies a transverse Mercator (or polar stereographic) of that body.
/// Errors: not projected, axes that do not run east and north, inputs too wide for one zone.
Result<OGRSpatialReference> chooseCrs(const std::string& crs, std::span<const InputRaster> inputs);

/// How many units of length a projected CRS shows for one on the ground there, to the east and to the north;
/// 1 where it is true to scale. Nothing where the place cannot be told.
struct Stretch {
  double east = 1.0;
  double north = 1.0;
};
std::optional<Stretch> stretchAt(const OGRSpatialReference& crs, double x, double y);

/// A name for people, also where the CRS has none.
std::string crsDisplayName(const OGRSpatialReference& crs);

/// WKT2 on one line.
std::string crsWkt(const OGRSpatialReference& crs);

}  // namespace terrane
