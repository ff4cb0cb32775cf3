#pragma once

#include <ogr_spatialref.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "input_gdal.h"
#include "input_list.h"
#include "terrane/base/result.h"

namespace terrane {

/// What is known of one input before its samples are read.
struct InputRaster {
  std::string path;  ///< as GDAL opens it
  std::string name;  ///< without folders
  uint64_t bytes = 0;
  int width = 0;   ///< pixels, at least 2
  int height = 0;  ///< pixels, at least 2
  GDALDataType type = GDT_Unknown;
  bool integer = false;  ///< integer typed

  /// CRS from pixel edges: x = g[0] + col * g[1] + row * g[2], y = g[3] + col * g[4] + row * g[5].
  std::array<double, 6> geoTransform{};
  bool hasGeoTransform = false;  ///< false: placed by ground control points, to be warped
  OGRSpatialReference crs;       ///< horizontal, x before y; empty where the file has none
  std::string verticalDatum;     ///< empty when unknown

  double heightScale = 1.0;      ///< metres for one raw step: the band's scale times its unit
  double heightOffset = 0.0;     ///< metres at raw 0
  std::optional<double> noData;  ///< raw value that means void, already rounded to the band's type
  bool mask = false;             ///< the band has a mask or alpha, to be read with it
  int alphaBand = 0;             ///< the alpha band behind the mask, 0 for none

  bool imageLike = false;             ///< looks like a picture: bytes, more than one band, red first
  std::vector<std::string> warnings;  ///< for the user, each naming the file

  double metersFromRaw(double raw) const { return heightOffset + raw * heightScale; }
  bool isVoid(double raw) const;
  /// What is treated as void, for the manifest.
  std::string voidText() const;
};

/// Opens a raster and looks at everything but its samples. `noData` overrides what the file says of void.
/// Errors: not a raster, no band, palette or complex values, fewer than 2 x 2 pixels, no georeferencing.
Result<InputRaster> describeRaster(const InputPath& input, const std::optional<double>& noData);

/// Reads a window of pixels, which must lie inside, as heights in metres, row by row, NaN for void. `raw`
/// and `mask` are scratch that keeps its memory. Errors name the file: bytes that are missing or corrupt.
Status readHeights(GDALDataset& dataset, const InputRaster& raster, int col, int row, int cols, int rows,
                   std::span<float> heights, std::vector<double>& raw, std::vector<uint8_t>& mask);

/// Metres in a vertical unit as files spell it ("ft", "US survey foot", ...); nothing when not known.
std::optional<double> metersFromUnitName(const std::string& name);

}  // namespace terrane
