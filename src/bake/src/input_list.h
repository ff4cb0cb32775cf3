#pragma once

#include <string>
#include <vector>

#include "terrane/base/result.h"

namespace terrane {

/// One raster to open.
struct InputPath {
  std::string path;         ///< as GDAL opens it
  bool fromFolder = false;  ///< found in a folder or archive, not named by the user
};

/// Turns what the user gave into rasters, in the order in which they lie on each other:
/// - a file or a GDAL name (/vsicurl/..., NETCDF:...) stands for itself;
/// - a folder for all rasters below it that GDAL recognises, sorted by path, sidecars left out;
/// - a glob (`*`, `?`, `[`) for its matches, sorted;
/// - `@list.txt` for its lines, each again one of these; empty lines and lines with `#` are skipped;
///   relative paths count from the working directory, else from the list's folder;
/// - a .zip that GDAL does not open itself for the rasters inside.
/// Errors: nothing there, an empty folder or glob, a list that holds itself. Opens no raster.
Result<std::vector<InputPath>> expandInputs(const std::vector<std::string>& inputs);

/// The file on disk behind a raster: itself, or the archive around it; empty where there is none.
std::string fileBehind(const std::string& path);

}  // namespace terrane
