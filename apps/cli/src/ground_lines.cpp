#include "ground_lines.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "terrane/bake/vector_file.h"

namespace terrane::cli {
namespace {

// What a line is where the file does not say: as the viewer draws it, and a dot that one can see.
constexpr std::array<float, 4> kUsualColor = {1.0F, 77 / 255.0F, 61 / 255.0F, 1.0F};
constexpr double kDotPixels = 9.0;

Status readColor(const std::string& path, const VectorLine& from, GroundLine& line) {
  std::string text = from.stroke;
  if (text.size() == 4) text = {text[0], text[1], text[1], text[2], text[2], text[3], text[3]};
  unsigned red = 0, green = 0, blue = 0;
  if (text.size() != 7 || std::sscanf(text.c_str(), "#%2x%2x%2x", &red, &green, &blue) != 3)
    return makeError("{}: {}: 'stroke' must be a colour like #d03020 or #d32, not '{}'", path, from.where,
                     from.stroke);
  line.srgba = {static_cast<float>(red) / 255.0F, static_cast<float>(green) / 255.0F,
                static_cast<float>(blue) / 255.0F, line.srgba[3]};
  return {};
}

}  // namespace

Result<std::vector<GroundLine>> readGroundLines(const std::string& path, const Manifest& manifest) {
  const Frame& frame = manifest.frame;
  const glm::dvec3 corner =
      frame.crsFromLocal(glm::dvec3(frame.localFromSample({static_cast<double>(manifest.extentCols - 1),
                                                           static_cast<double>(manifest.extentRows - 1)}),
                                    0.0));
  TERRANE_ASSIGN(const std::vector<VectorLine> read, readVectorLines(path, {.crsWkt = manifest.crsWkt,
                                                                            .west = frame.originEasting,
                                                                            .south = corner.y,
                                                                            .east = corner.x,
                                                                            .north = frame.originNorthing}));
  std::vector<GroundLine> lines;
  lines.reserve(read.size());
  for (const VectorLine& from : read) {
    GroundLine line{.corners = {}, .srgba = kUsualColor};
    if (from.corners.size() == 1) line.width = kDotPixels;
    line.corners.reserve(from.corners.size());
    for (const glm::dvec2& place : from.corners)
      line.corners.emplace_back(frame.localFromCrs({place.x, place.y, 0.0}));
    if (!from.stroke.empty()) TERRANE_TRY(readColor(path, from, line));
    if (from.strokeOpacity) line.srgba[3] = static_cast<float>(std::min(*from.strokeOpacity, 1.0));
    line.isWidthInMeters = from.strokeMeters.has_value();
    line.width = from.strokeMeters.value_or(from.strokePixels.value_or(line.width));
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace terrane::cli
