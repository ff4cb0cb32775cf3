#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <vector>

#include "terrane/base/result.h"

namespace terrane {

/// A line of a vector file and how that says it is to be drawn.
struct VectorLine {
  std::vector<glm::dvec2> corners;  ///< easting, northing in the CRS asked for; one corner alone is a point
  std::string stroke;               ///< colour as the file spells it, "#d03020"; empty where it says none
  std::optional<double> strokeOpacity;
  std::optional<double> strokePixels;  ///< width
  std::optional<double> strokeMeters;  ///< width on the ground
};

/// What is read of a vector file: coordinates in `crsWkt`, and what comes into a rectangle of it.
struct VectorWindow {
  std::string crsWkt;  ///< projected, x before y
  double west = 0.0;
  double south = 0.0;
  double east = 0.0;
  double north = 0.0;
};

/// The lines of a file that GDAL opens as vectors (GeoJSON, GPX, KML, GeoPackage, shapefiles, ...) that come
/// into the window: lines, outlines of polygons, points; the points that only make up GPX tracks and routes
/// are left out. Heights are dropped, curves become straight legs, and
/// what is straight in the file's CRS gets corners where it is not in the window's. Style is read from the
/// attributes of simplestyle ("stroke" or "color", "stroke-opacity", "stroke-width"), from "stroke-meters",
/// and where there are none from the style that the format itself carries; widths that are no numbers above 0
/// are left out. Where a layer names no CRS, coordinates that are no longitudes and latitudes are taken as
/// those of the window's. Errors name the file: it is missing, no vectors, damaged, in a CRS with no way to
/// the window's, or nothing of it comes into the window (says where it lies instead).
Result<std::vector<VectorLine>> readVectorLines(const std::string& path, const VectorWindow& window);

}  // namespace terrane
