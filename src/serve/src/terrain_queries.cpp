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

using Json = nlohmann::ordered_json;
using Answer = QueryResult<std::string>;

Json orNull(const std::optional<double>& number) {
  return number ? Json(*number) : Json(nullptr);
}

Json pair(glm::dvec2 p) {
  return Json::array({p.x, p.y});
}

/// The places of a question in sample coordinates.
struct Places {
  std::vector<glm::dvec2> samples;
  QueryRefusal refusal;  ///< words where one could not be transformed
};

Places placesOf(const std::vector<glm::dvec2>& points, bool areGeographic, const Frame& frame,
                Geographic& geographic) {
  Places out;
  for (size_t i = 0; i < points.size(); ++i) {
    glm::dvec2 crs = points[i];
    if (areGeographic) {
      const auto projected = geographic.crsFromGeographic(points[i]);
      if (!projected) {
        out.refusal = {400, geographic.available()
                                ? fmt::format("point {}: the dataset's CRS has no place for it", i + 1)
                                : "this dataset's CRS cannot be related to EPSG:4326; ask in its own CRS"};
        return out;
      }
      crs = *projected;
    }
    const glm::dvec3 local = frame.localFromCrs({crs, 0.0});
    out.samples.push_back(frame.sampleFromLocal(glm::dvec2(local)));
  }
  return out;
}

glm::dvec2 crsFromSample(const Frame& frame, glm::dvec2 sample) {
  return glm::dvec2(frame.crsFromLocal({frame.localFromSample(sample), 0.0}));
}

Json begin(const Manifest& manifest) {
  return {{"dataset", manifest.name},
          {"crs", manifest.crsName},
          {"verticalDatum", manifest.verticalDatum},
          {"maxErrorMeters", manifest.maxErrorMeters}};
}

Result<Json> elevations(Surface& surface, const std::vector<glm::dvec2>& places) {
  Json heights = Json::array();
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
Result<Json> profile(Surface& surface, const Frame& frame, const std::vector<glm::dvec2>& corners,
                     size_t count, Geographic& geographic) {
  TERRANE_ASSIGN(const auto points, profileAlong(surface, frame, corners, count));
  const auto onEllipsoid = distancesOnEllipsoid(points, frame, corners, geographic);
  Json distances = Json::array(), heights = Json::array();
  for (size_t i = 0; i < points.size(); ++i) {
    distances.push_back(onEllipsoid ? (*onEllipsoid)[i] : points[i].distanceMeters);
    heights.push_back(orNull(points[i].height));
  }
  const Json length = distances.empty() ? Json(0.0) : distances.back();
  return Json{{"measuredOn", measuredOn(onEllipsoid.has_value())},
              {"lengthMeters", length},
              {"distancesMeters", distances},
              {"heightsMeters", heights}};
}

/// One line of sight. `pieces`: how many triangles the question may still cross.
Result<QueryResult<Json>> sight(Surface& surface, const Manifest& manifest, const QueryRequest& query,
                                glm::dvec2 from, glm::dvec2 to, size_t& piecesLeft, Geographic& geographic) {
  const Frame& frame = manifest.frame;
  TERRANE_ASSIGN(const auto fromGround, surface.heightAt(from));
  TERRANE_ASSIGN(const auto toGround, surface.heightAt(to));
  const std::array<glm::dvec2, 2> ends{crsFromSample(frame, from), crsFromSample(frame, to)};
  const auto onEllipsoid = geographic.metersAlong(ends);
  const double length = onEllipsoid ? onEllipsoid->back() : metersBetween(frame, from, to);
  Json out = {{"to", pair(ends[1])},
              {"measuredOn", measuredOn(onEllipsoid.has_value())},
              {"distanceMeters", length},
              {"visible", nullptr}};
  if (!fromGround || !toGround) {
    out["reason"] = !fromGround ? "there is no ground at 'from'" : "there is no ground at this end";
    return QueryResult<Json>{out, {}};
  }

  const auto pieces = surface.along(from, to, piecesLeft);
  if (!pieces.ok()) return QueryResult<Json>{{}, {413, pieces.error().message}};
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
  return QueryResult<Json>{out, {}};
}

}  // namespace

Result<QueryResult<std::string>> answerQuery(const QueryRequest& query, SurfaceTiles& tiles,
                                             Geographic& geographic, const QueryLimits& limits) {
  const Manifest& manifest = tiles.dataset().manifest();
  const Places places = placesOf(query.points, query.geographic, manifest.frame, geographic);
  if (!places.refusal.words.empty()) return Answer{{}, places.refusal};
  Surface surface(tiles);
  Json out = begin(manifest);
  if (query.kind == QueryKind::Elevation) {
    TERRANE_ASSIGN(out["heightsMeters"], elevations(surface, places.samples));
  } else if (query.kind == QueryKind::Profile) {
    TERRANE_ASSIGN(const Json found,
                   profile(surface, manifest.frame, places.samples, query.samples, geographic));
    out.update(found);
  } else {
    const Places from = placesOf({query.from}, query.geographic, manifest.frame, geographic);
    if (!from.refusal.words.empty()) return Answer{{}, {400, "'from': " + from.refusal.words}};
    out["curvature"] = query.curvature;
    out["results"] = Json::array();
    size_t piecesLeft = limits.pieces;
    for (const glm::dvec2 to : places.samples) {
      TERRANE_ASSIGN(auto found,
                     sight(surface, manifest, query, from.samples[0], to, piecesLeft, geographic));
      if (!found.value) return Answer{{}, found.refusal};
      out["results"].push_back(std::move(*found.value));
    }
  }
  return Answer{out.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n", {}};
}

}  // namespace terrane::serve
