#pragma once

#include <string>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/dataset/manifest.h"
#include "terrane/render/ground_lines.h"

namespace terrane::cli {

/// Lines of a vector file, in whatever format and CRS GDAL knows, brought onto the dataset: those that come
/// into its rectangle (bake/vector_file.h). Colours are "#rgb", "#rrggbb", "rgb(1, 2, 3)" or a name of
/// CSS 2.1, a width in metres goes before one in pixels. A colour that is none is told on stderr. Errors: the
/// file's.
Result<std::vector<GroundLine>> readGroundLines(const std::string& path, const Manifest& manifest);

}  // namespace terrane::cli
