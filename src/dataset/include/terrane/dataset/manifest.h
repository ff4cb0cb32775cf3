#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/imagery_codec.h"
#include "terrane/codec/tile.h"
#include "terrane/tiling/frame.h"

namespace terrane {

/// One raster that a dataset was built from.
struct InputRecord {
  std::string name;  ///< file name without folders
  uint64_t bytes = 0;
  std::string sha256;  ///< of the file, hexadecimal
  int width = 0;       ///< pixels
  int height = 0;
  std::string dataType;    ///< GDAL's name: "Int16", "Float32"
  std::string sourceCrs;   ///< WKT2 that was used, given or the input's own
  bool warped = false;     ///< false: taken sample by sample
  std::string resampling;  ///< "cubic" or another of GDAL's names where warped, else empty
  int nativeLevel = 0;     ///< the finest level it has samples on
  std::string noData;      ///< what was treated as void: "-32768", "nan", "mask", "" for nothing
};

/// One file of a dataset.
struct ArchiveRecord {
  std::string name;  ///< "elevation.pmtiles"
  uint64_t bytes = 0;
  std::string sha256;
};

/// The archive of a layer of significance of the elevation: "elevation.pmtiles" for the first, 0, for later
/// ones "elevation-1.pmtiles" and so on.
std::string elevationArchiveName(int layer);

/// One layer of pictures over the ground.
struct ImageryLayerRecord {
  std::string name;                              ///< letters, digits, '-' and '_', at most 64
  std::string archive;                           ///< imageryArchiveName(name)
  ImageryFormat format = kDefaultImageryFormat;  ///< for people: each tile says its own, and the root is JPEG
  int quality = defaultImageryQuality(kDefaultImageryFormat);  ///< 1 to 100, the encoder's
  int finestLevel = 0;  ///< of the same quadtree as elevation; may be deeper
  uint64_t tileCount = 0;
  std::array<double, 4> bounds{};  ///< west, south, east, north: what is covered, CRS units
  std::string attribution;
  std::string bands;  ///< which bands became colours, of the first picture, for people
  std::vector<std::array<double, 2>> stretch;  ///< a channel: the values that became black and white
  std::vector<InputRecord> inputs;             ///< bottom to top
};
/// "imagery.pmtiles" for the layer "imagery", for others "imagery-NAME.pmtiles".
std::string imageryArchiveName(const std::string& layerName);
/// May a layer have this name?
bool isImageryName(const std::string& name);

/// `manifest.json` (docs/format/manifest.schema.json): all that a client must know before it asks for tiles.
struct Manifest {
  static constexpr int kFormatVersion = 1;

  int formatVersion = kFormatVersion;
  std::string name;     ///< the dataset directory's stem when it was built
  std::string crsWkt;   ///< WKT2, projected
  std::string crsName;  ///< for people: "WGS 84 / UTM zone 32N"
  Frame frame;
  int64_t extentCols = 0;  ///< samples from the world's north-west corner that can hold data, finest level
  int64_t extentRows = 0;
  double minHeight = 0.0;  ///< metres, over ground
  double maxHeight = 0.0;
  double maxErrorMeters = 0.0;  ///< stated bound |dataset - source| at the finest level; 0 for lossless
  ElevationScale scale;         ///< its layers of significance are those of the elevation archives
  uint64_t tileCount = 0;       ///< stored elevation tiles
  double coveredCells = 0.0;    ///< cells of the finest level that are ground
  /// The share of the root's samples with ground that stand at 0, within the bound: where it is not next to
  /// none, the heights have a level sea there. Nothing in older datasets.
  std::optional<double> zeroShare;
  std::vector<ImageryLayerRecord> imagery;  ///< bottom to top; empty in datasets without
  std::string verticalDatum;                ///< free text, empty when unknown
  std::string attribution;
  std::vector<ArchiveRecord> archives;
  std::vector<InputRecord> inputs;
  std::string builtBy;       ///< "terrane 0.1.0"
  std::string buildOptions;  ///< the options that shaped the result, as on the command line
};

/// The bytes of all elevation archives together.
uint64_t elevationBytes(const Manifest& manifest);

/// The manifest as JSON text, with "manifestSha256" over the whole text with that member's 64 digits taken as
/// zeros: no byte of it can change unseen.
std::string manifestToJson(const Manifest& manifest);

/// Parses and checks a manifest: unknown versions, missing or absurd members and a wrong manifestSha256 are
/// errors that name the member; `where` (a path or URL) begins every message.
Result<Manifest> manifestFromJson(const std::string& text, const std::string& where);

}  // namespace terrane
