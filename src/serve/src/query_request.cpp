#include "query_request.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "geographic.h"

namespace terrane::serve {
namespace {

using Json = nlohmann::json;
using ReadRequest = QueryResult<QueryRequest>;

template <class... Args>
ReadRequest refuseQuery(int status, fmt::format_string<Args...> format, Args&&... args) {
  return {{}, {status, fmt::format(format, std::forward<Args>(args)...)}};
}

constexpr double kHighestMeters = 1e6;
constexpr size_t kDefaultSamples = 200;

/// Which parameters a question of a kind knows.
std::vector<std::string_view> knownNames(QueryKind kind) {
  switch (kind) {
    case QueryKind::Elevation:
      return {"points", "crs"};
    case QueryKind::Profile:
      return {"points", "crs", "samples"};
    default:
      return {"from", "to", "crs", "eye", "target", "curvature", "refraction"};
  }
}

/// What the reader puts together from strings or from JSON before it is checked.
struct Parts {
  std::vector<glm::dvec2> points, from;
  std::string crs;
  std::optional<double> samples, eye, target, refraction;
  std::optional<bool> curvature;
};

std::optional<double> readFinite(std::string_view text) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(number)) return {};
  return number;
}

/// "1,2;3,4"; stops beyond `most`. Errors say which point.
Result<std::vector<glm::dvec2>> readPoints(std::string_view text, size_t most) {
  std::vector<glm::dvec2> points;
  while (!text.empty() && points.size() <= most) {
    const size_t end = std::min(text.find(';'), text.size());
    const std::string_view pair = text.substr(0, end);
    const size_t comma = std::min(pair.find(','), pair.size());
    const auto x = readFinite(pair.substr(0, comma));
    const auto y = readFinite(pair.substr(std::min(comma + 1, pair.size())));
    if (!x || !y) return makeError("point {} is no pair of numbers like 491500,6680500", points.size() + 1);
    points.emplace_back(*x, *y);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return points;
}

Result<glm::dvec2> pointFromJson(const Json& json) {
  if (!json.is_array() || json.size() != 2 || !json[0].is_number() || !json[1].is_number())
    return makeError("is no array of two numbers");
  const glm::dvec2 point(json[0].get<double>(), json[1].get<double>());
  if (!std::isfinite(point.x) || !std::isfinite(point.y)) return makeError("is not finite");
  return point;
}

/// note: PROJ would take much else for a CRS, files among it.
bool isEpsgName(std::string_view name) {
  constexpr std::string_view kAuthority = "EPSG:";
  constexpr size_t kMostDigits = 6;
  if (name.substr(0, kAuthority.size()) != kAuthority) return false;
  const std::string_view code = name.substr(kAuthority.size());
  return !code.empty() && code.size() <= kMostDigits &&
         std::all_of(code.begin(), code.end(), [](char c) { return c >= '0' && c <= '9'; });
}

size_t mostPoints(QueryKind kind, const QueryLimits& limits) {
  return kind == QueryKind::LineOfSight ? limits.targets : limits.points;
}

/// The checks that do not depend on how the question was written.
ReadRequest check(QueryKind kind, Parts parts, const QueryLimits& limits) {
  const char* list = kind == QueryKind::LineOfSight ? "to" : "points";
  const size_t least = kind == QueryKind::Profile ? 2 : 1, most = mostPoints(kind, limits);
  if (parts.points.size() < least)
    return refuseQuery(400, "'{}' needs at least {} point{}, as {}=X,Y;X,Y", list, least,
                       least == 1 ? "" : "s", list);
  if (parts.points.size() > most)
    return refuseQuery(413, "'{}' has more than {} points; ask in several requests", list, most);
  QueryRequest query;
  query.kind = kind;
  query.points = std::move(parts.points);
  if (kind == QueryKind::LineOfSight) {
    if (parts.from.size() != 1) return refuseQuery(400, "'from' must be one point, as from=X,Y");
    query.from = parts.from[0];
  }
  if (!parts.crs.empty() && parts.crs != "dataset") {
    query.crs = parts.crs == "OGC:CRS84" ? Geographic::kDegrees : parts.crs;
    if (!isEpsgName(query.crs))
      return refuseQuery(
          400,
          "'crs' must be an EPSG code like EPSG:4326 (longitude,latitude), or be left out for the "
          "dataset's own");
  }
  if (query.crs == Geographic::kDegrees) {
    std::vector<glm::dvec2> all = query.points;
    if (kind == QueryKind::LineOfSight) all.push_back(query.from);
    for (const glm::dvec2 p : all)
      if (std::abs(p.x) > 360.0 || std::abs(p.y) > 90.0)
        return refuseQuery(400, "{},{} is no longitude and latitude in degrees; longitude comes first", p.x,
                           p.y);
  }
  if (kind == QueryKind::Profile) {
    const double samples =
        parts.samples.value_or(static_cast<double>(std::min(kDefaultSamples, limits.samples)));
    if (samples < 2.0 || samples != std::floor(samples))
      return refuseQuery(400, "'samples' must be a whole number, 2 or more");
    if (samples > static_cast<double>(limits.samples))
      return refuseQuery(413, "'samples' may be at most {}", limits.samples);
    query.samples = static_cast<size_t>(samples);
  }
  query.eyeMeters = parts.eye.value_or(0.0);
  query.targetMeters = parts.target.value_or(0.0);
  query.refraction = parts.refraction.value_or(0.0);
  query.curvature = parts.curvature.value_or(false);
  for (const double height : {query.eyeMeters, query.targetMeters})
    if (!(height >= 0.0 && height <= kHighestMeters))
      return refuseQuery(400, "'eye' and 'target' are metres above the ground, 0 to {}", kHighestMeters);
  if (!(query.refraction >= 0.0 && query.refraction < 1.0))
    return refuseQuery(400, "'refraction' is a coefficient, 0 or more and below 1 (0.13 is usual)");
  if (query.refraction > 0.0 && !query.curvature)
    return refuseQuery(400, "'refraction' is of use with curvature=true only");
  return {std::move(query), {}};
}

std::string join(const std::vector<std::string_view>& names) {
  std::string out;
  for (const std::string_view name : names) out.append(out.empty() ? "" : ", ").append(name);
  return out;
}

}  // namespace

std::optional<QueryKind> queryKind(std::string_view name) {
  if (name == "elevation") return QueryKind::Elevation;
  if (name == "profile") return QueryKind::Profile;
  if (name == "line-of-sight") return QueryKind::LineOfSight;
  return {};
}

QueryResult<QueryRequest> readQuery(QueryKind kind, const RequestTarget& target, const QueryLimits& limits) {
  const auto known = knownNames(kind);
  Parts parts;
  for (const auto& [name, value] : target.query) {
    if (std::find(known.begin(), known.end(), name) == known.end())
      return refuseQuery(400, "there is no parameter '{}' here; there are: {}", name, join(known));
    if (name == "points" || name == "to" || name == "from") {
      auto points = readPoints(value, mostPoints(kind, limits));
      if (!points.ok()) return refuseQuery(400, "'{}': {}", name, points.error().message);
      (name == "from" ? parts.from : parts.points) = std::move(points).value();
    } else if (name == "crs") {
      parts.crs = value.empty() ? "?" : value;
    } else if (name == "curvature") {
      if (value != "true" && value != "false") return refuseQuery(400, "'curvature' must be true or false");
      parts.curvature = value == "true";
    } else {
      const auto number = readFinite(value);
      if (!number) return refuseQuery(400, "'{}' is no number: '{}'", name, value.substr(0, 40));
      (name == "samples"  ? parts.samples
       : name == "eye"    ? parts.eye
       : name == "target" ? parts.target
                          : parts.refraction) = *number;
    }
  }
  return check(kind, std::move(parts), limits);
}

QueryResult<QueryRequest> readQueryJson(QueryKind kind, std::string_view body, const QueryLimits& limits) {
  const Json json = Json::parse(body.begin(), body.end(), nullptr, false);
  if (!json.is_object())
    return refuseQuery(400, "the body is no JSON object like {{\"points\": [[491500, 6680500]]}}");
  const auto known = knownNames(kind);
  Parts parts;
  for (const auto& [key, value] : json.items()) {
    const std::string& name = key;
    if (std::find(known.begin(), known.end(), name) == known.end())
      return refuseQuery(400, "the body has an unknown member; there are: {}", join(known));
    if (name == "from") {
      const auto point = pointFromJson(value);
      if (!point.ok()) return refuseQuery(400, "'from' {}", point.error().message);
      parts.from = {*point};
    } else if (name == "points" || name == "to") {
      if (!value.is_array()) return refuseQuery(400, "'{}' is no array of points", name);
      if (value.size() > mostPoints(kind, limits))
        return refuseQuery(413, "'{}' has more than {} points; ask in several requests", name,
                           mostPoints(kind, limits));
      for (const Json& item : value) {
        const auto point = pointFromJson(item);
        if (!point.ok())
          return refuseQuery(400, "'{}': point {} {}", name, parts.points.size() + 1, point.error().message);
        parts.points.push_back(*point);
      }
    } else if (name == "crs") {
      if (!value.is_string()) return refuseQuery(400, "'crs' is no string");
      parts.crs = value.get<std::string>().empty() ? "?" : value.get<std::string>();
    } else if (name == "curvature") {
      if (!value.is_boolean()) return refuseQuery(400, "'curvature' must be true or false");
      parts.curvature = value.get<bool>();
    } else {
      if (!value.is_number()) return refuseQuery(400, "'{}' is no number", name);
      (name == "samples"  ? parts.samples
       : name == "eye"    ? parts.eye
       : name == "target" ? parts.target
                          : parts.refraction) = value.get<double>();
    }
  }
  return check(kind, std::move(parts), limits);
}

}  // namespace terrane::serve
