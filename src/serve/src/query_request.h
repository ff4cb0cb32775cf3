#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/serve/request_target.h"

namespace terrane::serve {

/// How much one question may ask for.
struct QueryLimits {
  size_t points = 10000;  ///< of /elevation; corners of a /profile's line; targets of /line-of-sight are 100
  size_t targets = 100;
  size_t samples = 20000;  ///< of a profile
  size_t pieces = 500000;  ///< triangles that the lines of a /line-of-sight cross, together
};

enum class QueryKind : uint8_t { Elevation, Profile, LineOfSight };
/// "elevation", "profile", "line-of-sight".
std::optional<QueryKind> queryKind(std::string_view name);

/// A question about the surface, read and checked, its places still as they were given.
struct QueryRequest {
  QueryKind kind = QueryKind::Elevation;
  std::vector<glm::dvec2> points;  ///< places; of a line of sight, where it ends
  glm::dvec2 from{0.0};            ///< of a line of sight
  std::string crs;                 ///< of the places, as "EPSG:2056"; empty: the dataset's
  size_t samples = 0;              ///< of a profile
  double eyeMeters = 0.0;          ///< above the ground
  double targetMeters = 0.0;
  bool curvature = false;
  double refraction = 0.0;  ///< coefficient k; the earth's radius becomes R / (1 - k)
};

/// A question that is refused: the status (400 or 413) and the words.
struct QueryRefusal {
  int status = 400;
  std::string words;
};
template <class T>
struct QueryResult {
  std::optional<T> value;
  QueryRefusal refusal;
};

/// From "?points=1,2;3,4&crs=EPSG:4326".
QueryResult<QueryRequest> readQuery(QueryKind kind, const RequestTarget& target, const QueryLimits& limits);
/// From a JSON object with members of the same names, points as arrays of two numbers.
QueryResult<QueryRequest> readQueryJson(QueryKind kind, std::string_view body, const QueryLimits& limits);

}  // namespace terrane::serve
