#pragma once

#include <string>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/dataset/manifest.h"
#include "terrane/render/ground_lines.h"

namespace terrane::cli {

/// Lines of a GeoJSON file whose coordinates are eastings and northings of the dataset's CRS: lines, outlines
/// of polygons, points as dots. Properties as simplestyle has them: "stroke" (#rrggbb), "stroke-opacity",
/// "stroke-width" in pixels; or "stroke-meters", a width on the ground. Errors: the file, and what in it is
/// not so; none of it lying on the dataset, as where it is in another CRS.
Result<std::vector<GroundLine>> readGroundLines(const std::string& path, const Manifest& manifest);

}  // namespace terrane::cli
