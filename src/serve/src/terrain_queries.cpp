#include "terrain_queries.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "geographic.h"
#include "terrane/engine/line_of_sight.h"
#include "terrane/engine/surface.h"
#include "terrane/engine/surface_profile.h"

namespace terrane::serve {
namespace {

using OrderedJson = nlohmann::ordered_json;
using QueryAnswer = QueryResult<std::string>;

OrderedJson orNull(const std::optional<double>& number) {
  return number ? OrderedJson(*number) : OrderedJson(nullptr);
}

OrderedJson pair(glm::dvec2 p) {
  return OrderedJson::array({p.x, p.y});
}

/// The places of a question in sample coordinates.
struct Places {
  std::vector<glm::dvec2> samples;
  QueryRefusal refusal;  ///< words where one could not be transformed
};

Places placesOf(std::vector<glm::dvec2> points, const std::string& crs, const Frame& frame,
                Geographic& geographic) {
  Places out;
  if (!crs.empty()) {
    if (!geographic.available(crs)) {
      out.refusal = {
          400, fmt::format("{} is not known here, or this dataset's CRS cannot be related to it; ask in "
                           "the dataset's own CRS",
                           crs)};
      return out;
    }
    points = geographic.crsFrom(crs, points);
  }
  for (size_t i = 0; i < points.size(); ++i) {
    if (std::isnan(points[i].x)) {
      out.refusal = {400, fmt::format("point {}: the dataset's CRS has no place for it", i + 1)};
      return out;
    }
    const glm::dvec3 local = frame.localFromCrs({points[i], 0.0});
    out.samples.push_back(frame.sampleFromLocal(glm::dvec2(local)));
  }
  return out;
}

glm::dvec2 crsFromSample(const Frame& frame, glm::dvec2 sample) {
  return glm::dvec2(frame.crsFromLocal({frame.localFromSample(sample), 0.0}));
}

OrderedJson begin(const std::string& name, const Manifest& manifest) {
  return {{"dataset", name},
          {"crs", manifest.crsName},
          {"verticalDatum", manifest.verticalDatum},
          {"maxErrorMeters", manifest.maxErrorMeters}};
}

Result<OrderedJson> elevations(Surface& surface, const std::vector<glm::dvec2>& places) {
  OrderedJson heights = OrderedJson::array();
  for (const glm::dvec2 place : places) {
    TERRANE_ASSIGN(const auto height, surface.heightAt(place));
    heights.push_back(orNull(height));
  }
  return heights;
}

/// How lengths of an answer were measured: on the ellipsoid, or where PROJ does not know it, as the
/// projection shows them.
const char* measuredOn(bool isEllipsoid) {
  return isEllipsoid ? "ellipsoid" : "projection";
}

/// Metres on the ellipsoid from the beginning of a line to the places of its profile, or nothing.
std::optional<std::vector<double>> distancesOnEllipsoid(const std::vector<ProfilePoint>& points,
                                                        const Frame& frame,
                                                        const std::vector<glm::dvec2>& corners,
                                                        Geographic& geographic) {
  // Places and the corners between them, one after the other.
  std::vector<glm::dvec2> line;
  std::vector<size_t> at;
  size_t corner = 0;
  for (const ProfilePoint& point : points) {
    while (corner < point.leg) line.push_back(crsFromSample(frame, corners[++corner]));
    at.push_back(line.size());
    line.push_back(crsFromSample(frame, point.sample));
  }
  const auto along = geographic.metersAlong(line);
  if (!along) return std::nullopt;
  std::vector<double> out;
  out.reserve(at.size());
  for (const size_t i : at) out.push_back((*along)[i]);
  return out;
}

/// `count` places along a line of straight legs, at equal distances in the projection, both ends included.
Result<OrderedJson> profile(Surface& surface, const Frame& frame, const std::vector<glm::dvec2>& corners,
                            size_t count, Geographic& geographic) {
  TERRANE_ASSIGN(const auto points, profileAlong(surface, frame, corners, count));
  const auto onEllipsoid = distancesOnEllipsoid(points, frame, corners, geographic);
  OrderedJson distances = OrderedJson::array(), heights = OrderedJson::array();
  for (size_t i = 0; i < points.size(); ++i) {
    distances.push_back(onEllipsoid ? (*onEllipsoid)[i] : points[i].distanceMeters);
    heights.push_back(orNull(points[i].height));
  }
  const OrderedJson length = distances.empty() ? OrderedJson(0.0) : distances.back();
  return OrderedJson{{"measuredOn", measuredOn(onEllipsoid.has_value())},
                     {"lengthMeters", length},
                     {"distancesMeters", distances},
                     {"heightsMeters", heights}};
}

/// One line of sight. `pieces`: how many triangles the question may still cross.
Result<QueryResult<OrderedJson>> sight(Surface& surface, const Manifest& manifest, const QueryRequest& query,
                                       glm::dvec2 from, glm::dvec2 to, size_t& piecesLeft,
                                       Geographic& geographic) {
  const Frame& frame = manifest.frame;
  TERRANE_ASSIGN(const auto fromGround, surface.heightAt(from));
  TERRANE_ASSIGN(const auto toGround, surface.heightAt(to));
  const std::array<glm::dvec2, 2> ends{crsFromSample(frame, from), crsFromSample(frame, to)};
  const auto onEllipsoid = geographic.metersAlong(ends);
  const double length = onEllipsoid ? onEllipsoid->back() : metersBetween(frame, from, to);
  OrderedJson out = {{"to", pair(ends[1])},
                     {"measuredOn", measuredOn(onEllipsoid.has_value())},
                     {"distanceMeters", length},
                     {"visible", nullptr}};
  if (!fromGround || !toGround) {
    out["reason"] = !fromGround ? "there is no ground at 'from'" : "there is no ground at this end";
    return QueryResult<OrderedJson>{out, {}};
  }

  const auto pieces = surface.along(from, to, piecesLeft);
  if (!pieces.ok()) return QueryResult<OrderedJson>{{}, {413, pieces.error().message}};
  piecesLeft -= std::min(piecesLeft, pieces->size());

  SightLine line;
  line.fromHeight = *fromGround + query.eyeMeters;
  line.toHeight = *toGround + query.targetMeters;
  line.lengthMeters = length;
  if (query.curvature) line.radiusMeters = sightRadiusMeters(query.refraction, ellipsoidOf(manifest.crsWkt));
  const SightResult result = lookAlong(*pieces, line);
  out["visible"] = result.visible;
  out["fromHeightMeters"] = line.fromHeight;
  out["toHeightMeters"] = line.toHeight;
  out["clearanceMeters"] = orNull(result.clearanceMeters);
  // Surface and line may both be off by the bound.
  out["certain"] = !result.clearanceMeters ||
                   std::abs(*result.clearanceMeters) > 2.0 * manifest.maxErrorMeters ||
                   manifest.maxErrorMeters == 0.0;
  if (result.blockedAt) {
    out["blockedBy"] = {{"point", pair(crsFromSample(frame, from + *result.blockedAt * (to - from)))},
                        {"distanceMeters", *result.blockedAt * length},
                        {"heightMeters", result.blockedHeight}};
  }
  return QueryResult<OrderedJson>{out, {}};
}

}  // namespace

Result<QueryResult<std::string>> answerQuery(const QueryRequest& query, const std::string& name,
                                             SurfaceTiles& tiles, Geographic& geographic,
                                             const QueryLimits& limits) {
  const Manifest& manifest = tiles.dataset().manifest();
  const Places places = placesOf(query.points, query.crs, manifest.frame, geographic);
  if (!places.refusal.words.empty()) return QueryAnswer{{}, places.refusal};
  Surface surface(tiles);
  OrderedJson out = begin(name, manifest);
  if (query.kind == QueryKind::Elevation) {
    TERRANE_ASSIGN(out["heightsMeters"], elevations(surface, places.samples));
  } else if (query.kind == QueryKind::Profile) {
    TERRANE_ASSIGN(const OrderedJson found,
                   profile(surface, manifest.frame, places.samples, query.samples, geographic));
    out.update(found);
  } else {
    const Places from = placesOf({query.from}, query.crs, manifest.frame, geographic);
    if (!from.refusal.words.empty()) return QueryAnswer{{}, {400, "'from': " + from.refusal.words}};
    out["curvature"] = query.curvature;
    out["results"] = OrderedJson::array();
    size_t piecesLeft = limits.pieces;
    for (const glm::dvec2 to : places.samples) {
      TERRANE_ASSIGN(auto found,
                     sight(surface, manifest, query, from.samples[0], to, piecesLeft, geographic));
      if (!found.value) return QueryAnswer{{}, found.refusal};
      out["results"].push_back(std::move(*found.value));
    }
  }
  return QueryAnswer{out.dump(-1, ' ', false, OrderedJson::error_handler_t::replace) + "\n", {}};
}

}  // namespace terrane::serve
