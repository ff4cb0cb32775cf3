#pragma once

#include <string>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/render/ground_lines.h"
#include "terrane/tiling/frame.h"

namespace terrane::cli {

/// Lines of a GeoJSON file whose coordinates are eastings and northings of the dataset's CRS: lines, outlines
/// of polygons, points as dots. Properties as simplestyle has them: "stroke" (#rrggbb), "stroke-opacity",
/// "stroke-width" in pixels; or "stroke-meters", a width on the ground. Errors: the file, and what in it is
/// not so.
Result<std::vector<GroundLine>> readGroundLines(const std::string& path, const Frame& frame);

}  // namespace terrane::cli
