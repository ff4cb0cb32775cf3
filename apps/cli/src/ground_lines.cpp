#include "ground_lines.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <optional>

#include "terrane/bake/vector_file.h"

namespace terrane::cli {
namespace {

// What a line is where the file does not say: as the viewer draws it, and a dot that one can see.
constexpr std::array<float, 4> kUsualColor = {1.0F, 77 / 255.0F, 61 / 255.0F, 1.0F};
constexpr double kDotPixels = 9.0;

struct NamedColor {
  const char* name;
  unsigned rgb;
};
// Those of CSS 2.1.
constexpr NamedColor kColors[] = {{"maroon", 0x800000},  {"red", 0xff0000},   {"orange", 0xffa500},
                                  {"yellow", 0xffff00},  {"olive", 0x808000}, {"purple", 0x800080},
                                  {"fuchsia", 0xff00ff}, {"white", 0xffffff}, {"lime", 0x00ff00},
                                  {"green", 0x008000},   {"navy", 0x000080},  {"blue", 0x0000ff},
                                  {"aqua", 0x00ffff},    {"teal", 0x008080},  {"black", 0x000000},
                                  {"silver", 0xc0c0c0},  {"gray", 0x808080}};

// "#rgb", "#rrggbb", "rgb(1, 2, 3)" or a name; nothing where a text is no such colour.
std::optional<unsigned> rgbOf(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  for (const NamedColor& color : kColors) {
    if (text == color.name) return color.rgb;
  }
  unsigned red = 0, green = 0, blue = 0;
  if (std::sscanf(text.c_str(), "rgb(%3u ,%3u ,%3u", &red, &green, &blue) == 3 && red < 256 && green < 256 &&
      blue < 256)
    return red << 16 | green << 8 | blue;
  if (text.size() == 4) text = {text[0], text[1], text[1], text[2], text[2], text[3], text[3]};
  const bool isHex = text.size() == 7 && text[0] == '#' &&
                     text.find_first_not_of("0123456789abcdef", 1) == std::string::npos;
  if (!isHex) return std::nullopt;
  return static_cast<unsigned>(std::stoul(text.substr(1), nullptr, 16));
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
  size_t unknownColors = 0;
  std::string oneOfThem;
  for (const VectorLine& from : read) {
    GroundLine line{.corners = {}, .srgba = kUsualColor};
    if (from.corners.size() == 1) line.width = kDotPixels;
    line.corners.reserve(from.corners.size());
    for (const glm::dvec2& place : from.corners)
      line.corners.emplace_back(frame.localFromCrs({place.x, place.y, 0.0}));
    if (const auto rgb = rgbOf(from.stroke)) {
      for (size_t i = 0; i < 3; ++i) line.srgba[i] = static_cast<float>(*rgb >> (16 - 8 * i) & 255U) / 255.0F;
    } else if (!from.stroke.empty()) {
      ++unknownColors;
      oneOfThem = from.stroke;
    }
    if (from.strokeOpacity) line.srgba[3] = static_cast<float>(std::min(*from.strokeOpacity, 1.0));
    line.isWidthInMeters = from.strokeMeters.has_value();
    line.width = from.strokeMeters.value_or(from.strokePixels.value_or(line.width));
    lines.push_back(std::move(line));
  }
  if (unknownColors > 0) {
    fmt::print(stderr,
               "terrane: warning: {}: {} of its lines have a 'stroke' that is no colour like #d03020 ('{}'); "
               "they are drawn in the usual one\n",
               path, unknownColors, oneOfThem);
  }
  return lines;
}

}  // namespace terrane::cli
