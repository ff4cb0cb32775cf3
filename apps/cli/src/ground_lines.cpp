#include "ground_lines.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>
#include <sstream>

namespace terrane::cli {
namespace {

using Json = nlohmann::json;

class Reader {
 public:
  Reader(const std::string& path, const Frame& frame) : path_(path), frame_(frame) {}

  Status read(const Json& object, const std::string& where) {
    const std::string type =
        object.is_object() && object.contains("type") && object["type"].is_string() ? object["type"] : "";
    if (type == "FeatureCollection") return each(object, "features", where);
    if (type == "GeometryCollection") return each(object, "geometries", where);
    if (type == "Feature") {
      const GroundLine before = style_;
      if (object.contains("properties")) TERRANE_TRY(readStyle(object["properties"], where));
      const Status done = object.contains("geometry") && !object["geometry"].is_null()
                              ? read(object["geometry"], where)
                              : Status{};
      style_ = before;
      return done;
    }
    const Json coordinates =
        object.is_object() && object.contains("coordinates") ? object["coordinates"] : Json();
    if (type == "Point") return addLine(Json::array({coordinates}), where);
    if (type == "LineString") return addLine(coordinates, where);
    if (type == "MultiPoint") return addEach(coordinates, where, 0);
    if (type == "MultiLineString" || type == "Polygon") return addEach(coordinates, where, 1);
    if (type == "MultiPolygon") return addEach(coordinates, where, 2);
    return makeError("{}: {}: expected a GeoJSON feature or geometry, not type '{}'", path_, where, type);
  }
  std::vector<GroundLine> take() { return std::move(lines_); }

 private:
  Status each(const Json& object, const char* member, const std::string& where) {
    if (!object.contains(member) || !object[member].is_array())
      return makeError("{}: {}: '{}' must be an array", path_, where, member);
    size_t i = 0;
    for (const Json& part : object[member]) TERRANE_TRY(read(part, fmt::format("{}[{}]", member, i++)));
    return {};
  }

  /// `depth`: arrays around a line's own.
  Status addEach(const Json& coordinates, const std::string& where, int depth) {
    if (!coordinates.is_array()) return makeError("{}: {}: 'coordinates' must be an array", path_, where);
    for (const Json& part : coordinates) {
      if (depth == 0)
        TERRANE_TRY(addLine(Json::array({part}), where));
      else if (depth == 1)
        TERRANE_TRY(addLine(part, where));
      else
        TERRANE_TRY(addEach(part, where, depth - 1));
    }
    return {};
  }

  Status addLine(const Json& coordinates, const std::string& where) {
    if (!coordinates.is_array()) return makeError("{}: {}: 'coordinates' must be an array", path_, where);
    GroundLine line = style_;
    for (const Json& place : coordinates) {
      if (!place.is_array() || place.size() < 2 || !place[0].is_number() || !place[1].is_number())
        return makeError("{}: {}: a place must be [easting, northing] in the dataset's CRS", path_, where);
      line.corners.emplace_back(frame_.localFromCrs({place[0].get<double>(), place[1].get<double>(), 0.0}));
    }
    if (!line.corners.empty()) lines_.push_back(std::move(line));
    return {};
  }

  Status readStyle(const Json& properties, const std::string& where) {
    if (!properties.is_object()) return {};
    if (const auto stroke = properties.find("stroke"); stroke != properties.end()) {
      unsigned red = 0, green = 0, blue = 0;
      std::string text = stroke->is_string() ? stroke->get<std::string>() : "";
      if (text.size() == 4) text = {text[0], text[1], text[1], text[2], text[2], text[3], text[3]};
      if (text.size() != 7 || std::sscanf(text.c_str(), "#%2x%2x%2x", &red, &green, &blue) != 3)
        return makeError("{}: {}: 'stroke' must be a colour like #d03020 or #d32", path_, where);
      style_.srgba = {static_cast<float>(red) / 255.0F, static_cast<float>(green) / 255.0F,
                      static_cast<float>(blue) / 255.0F, style_.srgba[3]};
    }
    for (const char* name : {"stroke-opacity", "stroke-width", "stroke-meters"}) {
      const auto found = properties.find(name);
      if (found == properties.end()) continue;
      const double value = found->is_number() ? found->get<double>() : -1.0;
      if (!(value > 0.0 && value <= 1e6))
        return makeError("{}: {}: '{}' must be above 0", path_, where, name);
      if (name == std::string("stroke-opacity")) {
        style_.srgba[3] = static_cast<float>(std::min(value, 1.0));
      } else {
        style_.width = value;
        style_.isWidthInMeters = name == std::string("stroke-meters");
      }
    }
    return {};
  }

  const std::string& path_;
  const Frame& frame_;
  GroundLine style_;
  std::vector<GroundLine> lines_;
};

/// The CRS that a file of the old form declares, as text; empty where it says none.
std::string declaredCrs(const Json& json) {
  if (!json.is_object() || !json.contains("crs")) return {};
  const Json name =
      json["crs"].is_object() ? json["crs"].value("/properties/name"_json_pointer, Json()) : Json();
  return name.is_string() ? name.get<std::string>() : std::string();
}

/// Does any of the lines come into the dataset's rectangle?
bool anyOn(const std::vector<GroundLine>& lines, const Manifest& manifest) {
  const glm::dvec2 corner = manifest.frame.localFromSample(
      {static_cast<double>(manifest.extentCols - 1), static_cast<double>(manifest.extentRows - 1)});
  for (const GroundLine& line : lines) {
    glm::dvec2 low(line.corners.front()), high(line.corners.front());
    for (const auto& place : line.corners) {
      low = glm::min(low, glm::dvec2(place));
      high = glm::max(high, glm::dvec2(place));
    }
    if (low.x <= corner.x && high.x >= 0.0 && low.y <= 0.0 && high.y >= corner.y) return true;
  }
  return false;
}

}  // namespace

Result<std::vector<GroundLine>> readGroundLines(const std::string& path, const Manifest& manifest) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) return makeError("{}: cannot be read; does it exist?", path);
  const Json json = Json::parse(text.str(), nullptr, false);
  if (json.is_discarded())
    return makeError("{}: is no JSON; convert it: ogr2ogr -f GeoJSON lines.geojson {}", path, path);
  Reader reader(path, manifest.frame);
  TERRANE_TRY(reader.read(json, "the file"));
  std::vector<GroundLine> lines = reader.take();
  if (!anyOn(lines, manifest)) {
    const std::string declared = declaredCrs(json);
    return makeError(
        "{}: none of its {} lines lies on the dataset; coordinates must be in the dataset's CRS ({}){}: "
        "ogr2ogr -t_srs "
        "'EPSG:...' lines.geojson {}",
        path, lines.size(), manifest.crsName, declared.empty() ? "" : ", not in " + declared, path);
  }
  return lines;
}

}  // namespace terrane::cli
