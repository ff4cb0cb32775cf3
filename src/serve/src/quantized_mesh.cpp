#include "quantized_mesh.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "filled_ground.h"
#include "right_triangles.h"

namespace terrane::serve {
namespace {

constexpr double kSemiMajor = 6378137.0;
constexpr double kFlattening = 1.0 / 298.257223563;
constexpr double kRadians = std::numbers::pi / 180.0;
/// CesiumJS's: TerrainProvider.getEstimatedLevelZeroGeometricErrorForAHeightmap() for 65 heights and two
/// tiles.
constexpr double kLevelZeroError = kSemiMajor * 2.0 * std::numbers::pi * 0.25 / (65.0 * 2.0);
/// Of that error the mesh may take so much; the rest is for what lies between the samples that it is made of.
constexpr double kMeshShare = 0.5;
/// At the deepest level, of the dataset's spacing, where its own bound is not more.
constexpr double kFinestShare = 1e-3;
constexpr int kMostCells = 256;
constexpr int kLeastCells = 64;
constexpr double kQuantized = 32767.0;

glm::dvec3 geocentric(glm::dvec2 degrees, double height) {
  constexpr double kSquaredEccentricity = kFlattening * (2.0 - kFlattening);
  const double longitude = degrees.x * kRadians, latitude = degrees.y * kRadians;
  const double sine = std::sin(latitude), cosine = std::cos(latitude);
  const double normal = kSemiMajor / std::sqrt(1.0 - kSquaredEccentricity * sine * sine);
  return {(normal + height) * cosine * std::cos(longitude), (normal + height) * cosine * std::sin(longitude),
          (normal * (1.0 - kSquaredEccentricity) + height) * sine};
}

/// How far along `direction`, in a space where the ellipsoid is the unit sphere, a point must be so that it
/// is hidden only where `place` is.
double horizonMagnitude(glm::dvec3 place, glm::dvec3 direction) {
  const double semiMinor = kSemiMajor * (1.0 - kFlattening);
  const glm::dvec3 scaled = place / glm::dvec3(kSemiMajor, kSemiMajor, semiMinor);
  const double length = glm::length(scaled), magnitude = std::max(length, 1.0);
  const double cosAlpha = glm::dot(scaled / length, direction);
  const double sinAlpha = glm::length(glm::cross(scaled / length, direction));
  const double cosBeta = 1.0 / magnitude, sinBeta = std::sqrt(magnitude * magnitude - 1.0) * cosBeta;
  const double below = cosAlpha * cosBeta - sinAlpha * sinBeta;
  // Beyond a quarter of the world no point does; one that is far out is never hidden.
  constexpr double kFar = 1e3;
  return below > 1.0 / kFar ? 1.0 / below : kFar;
}

/// A unit vector in two bytes (Cigolle and others, "Survey of Efficient Representations for Independent Unit
/// Vectors").
std::array<uint8_t, 2> octEncoded(glm::dvec3 n) {
  const double sum = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
  double x = n.x / sum, y = n.y / sum;
  if (n.z < 0.0) {
    const double folded = (1.0 - std::abs(y)) * (x < 0.0 ? -1.0 : 1.0);
    y = (1.0 - std::abs(x)) * (y < 0.0 ? -1.0 : 1.0);
    x = folded;
  }
  const auto byte = [](double v) {
    return static_cast<uint8_t>(std::lround((std::clamp(v, -1.0, 1.0) * 0.5 + 0.5) * 255.0));
  };
  return {byte(x), byte(y)};
}

class Writer {
 public:
  template <class T>
  void put(T value) {
    static_assert(std::endian::native == std::endian::little);
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    text.append(bytes, sizeof(T));
  }
  void put(glm::dvec3 v) { put(v.x), put(v.y), put(v.z); }
  /// Differences to the one before, signs in the lowest bit.
  void putDifferences(const std::vector<int>& values) {
    int before = 0;
    for (const int value : values) {
      const int difference = value - before;
      put(static_cast<uint16_t>(difference << 1 ^ difference >> 31));
      before = value;
    }
  }
  /// An index: 16 bits where all of them fit.
  void putIndex(uint32_t index, bool isWide) {
    if (isWide)
      put(index);
    else
      put(static_cast<uint16_t>(index));
  }
  std::string text;
};

/// A tile's square of degrees, and a lattice over it.
struct TileSquare {
  TileSquare(const XyzAddress& address, int cellsOfSide)
      : side(std::ldexp(180.0, -address.z)),
        west(-180.0 + address.x * side),
        north(-90.0 + (address.y + 1) * side),
        cells(cellsOfSide) {}
  glm::dvec2 degreesOf(double col, double row) const {
    return {west + side * col / cells, north - side * row / cells};
  }
  double side;
  double west;
  double north;
  int cells;
};

/// Finest samples in a degree of latitude, in the middle of the dataset.
double samplesADegree(const XyzExtent& extent) {
  const double latitude = 0.5 * (extent.south + extent.north) * kRadians;
  return extent.samplesOfRoot * kXyzSide / 360.0 / std::cos(latitude);
}

/// Upwards at every place of a lattice, from heights around it.
std::vector<glm::dvec3> normalsOf(const std::vector<float>& heights, const TileSquare& square,
                                  const std::vector<RightTriangles::Vertex>& vertices) {
  const int side = square.cells + 1;
  std::vector<glm::dvec3> out;
  out.reserve(vertices.size());
  for (const RightTriangles::Vertex& vertex : vertices) {
    const int west = std::max(vertex.col - 1, 0), east = std::min(vertex.col + 1, square.cells);
    const int north = std::max(vertex.row - 1, 0), south = std::min(vertex.row + 1, square.cells);
    const auto place = [&](int col, int row) {
      return geocentric(square.degreesOf(col, row),
                        static_cast<double>(heights[static_cast<size_t>(row * side + col)]));
    };
    const glm::dvec3 eastward = place(east, vertex.row) - place(west, vertex.row);
    const glm::dvec3 northward = place(vertex.col, north) - place(vertex.col, south);
    const glm::dvec3 normal = glm::cross(eastward, northward);
    const double length = glm::length(normal);
    // At a pole a row is one point.
    out.push_back(length > 0.0 ? normal / length : glm::normalize(place(vertex.col, vertex.row)));
  }
  return out;
}

std::string encoded(const TileSquare& square, const std::vector<float>& heights, const RightTriangles& mesh) {
  const int cells = square.cells;
  const auto heightOf = [&](const RightTriangles::Vertex& v) {
    return static_cast<double>(heights[static_cast<size_t>(v.row * (cells + 1) + v.col)]);
  };
  double low = heightOf(mesh.vertices.front()), high = low;
  for (const auto& vertex : mesh.vertices) {
    low = std::min(low, heightOf(vertex));
    high = std::max(high, heightOf(vertex));
  }

  // The head: where the tile is, and when the horizon hides it.
  Writer out;
  const glm::dvec3 center = geocentric(square.degreesOf(0.5 * cells, 0.5 * cells), 0.5 * (low + high));
  const double semiMinor = kSemiMajor * (1.0 - kFlattening);
  const glm::dvec3 direction = glm::normalize(center / glm::dvec3(kSemiMajor, kSemiMajor, semiMinor));
  double radius = 0.0, horizon = 1.0;
  for (const auto& vertex : mesh.vertices) {
    const glm::dvec3 place = geocentric(square.degreesOf(vertex.col, vertex.row), heightOf(vertex));
    radius = std::max(radius, glm::length(place - center));
    horizon = std::max(horizon, horizonMagnitude(place, direction));
  }
  out.put(center);
  out.put(static_cast<float>(low));
  out.put(static_cast<float>(high));
  out.put(center);
  out.put(radius);
  out.put(direction * horizon);

  // Vertices.
  std::vector<int> u, v, h;
  for (const auto& vertex : mesh.vertices) {
    u.push_back(static_cast<int>(std::lround(vertex.col * kQuantized / cells)));
    v.push_back(static_cast<int>(std::lround((cells - vertex.row) * kQuantized / cells)));
    h.push_back(
        high > low ? static_cast<int>(std::lround((heightOf(vertex) - low) / (high - low) * kQuantized)) : 0);
  }
  out.put(static_cast<uint32_t>(mesh.vertices.size()));
  for (const std::vector<int>* values : {&u, &v, &h}) out.putDifferences(*values);

  // Indices, each as the difference to the next one that has not been used.
  const bool isWide = mesh.vertices.size() > 65536;
  if (isWide && out.text.size() % 4 != 0) out.put(uint16_t{0});
  out.put(static_cast<uint32_t>(mesh.indices.size() / 3));
  uint32_t next = 0;
  for (const uint32_t index : mesh.indices) {
    out.putIndex(next - index, isWide);
    if (index == next) ++next;
  }
  // The vertices on the western, southern, eastern and northern edge, from which skirts hang.
  const auto putEdge = [&](auto isOn) {
    std::vector<uint32_t> edge;
    for (size_t i = 0; i < mesh.vertices.size(); ++i)
      if (isOn(mesh.vertices[i])) edge.push_back(static_cast<uint32_t>(i));
    out.put(static_cast<uint32_t>(edge.size()));
    for (const uint32_t index : edge) out.putIndex(index, isWide);
  };
  putEdge([](const auto& vertex) { return vertex.col == 0; });
  putEdge([cells](const auto& vertex) { return vertex.row == cells; });
  putEdge([cells](const auto& vertex) { return vertex.col == cells; });
  putEdge([](const auto& vertex) { return vertex.row == 0; });

  // An extension: normals.
  constexpr uint8_t kOctVertexNormals = 1;
  out.put(kOctVertexNormals);
  out.put(static_cast<uint32_t>(2 * mesh.vertices.size()));
  for (const glm::dvec3& normal : normalsOf(heights, square, mesh.vertices))
    for (const uint8_t byte : octEncoded(normal)) out.put(byte);
  return std::move(out.text);
}

}  // namespace

int deepestTerrainLevel(const XyzExtent& extent) {
  const double level = std::log2(180.0 / kLeastCells * samplesADegree(extent));
  return std::clamp(static_cast<int>(std::ceil(level - 1e-6)), 0, kDeepestXyz);
}

std::optional<XyzAddress> readTerrainAddress(std::string_view z, std::string_view x, std::string_view y) {
  // Twice as many columns as rows.
  const auto half = readXyz(z, "0", y);
  if (!half) return {};
  const auto column = readXyz(std::to_string(half->z + 1), x, "0");
  if (!column) return {};
  return XyzAddress{half->z, column->x, half->y};
}

Result<std::string> terrainTile(const XyzAddress& address, const XyzExtent& extent, SurfaceTiles& tiles,
                                Geographic& geographic) {
  const Manifest& manifest = tiles.manifest();
  const double samples = samplesADegree(extent) * std::ldexp(180.0, -address.z);
  // As many cells as there are samples, within limits.
  int cells = kLeastCells;
  while (cells < kMostCells && cells < samples) cells *= 2;
  const TileSquare square(address, cells);
  const auto degreesOf = [&](double col, double row) { return square.degreesOf(col, row); };
  const std::vector<glm::dvec2> places =
      samplesOfLattice(cells + 1, degreesOf, extent, manifest.frame, geographic);
  FilledGround ground(tiles, levelFor(samples / cells, manifest.frame.finestLevel));
  std::vector<float> heights(places.size());
  for (size_t i = 0; i < places.size(); ++i) {
    TERRANE_ASSIGN(const double height, ground.heightAt(places[i]));
    heights[i] = static_cast<float>(height);
  }
  const bool isDeepest = address.z >= deepestTerrainLevel(extent);
  const double finest = std::max(manifest.maxErrorMeters, kFinestShare * manifest.frame.spacingXMeters());
  const double bound = isDeepest ? finest : kMeshShare * std::ldexp(kLevelZeroError, -address.z);
  return encoded(square, heights, rightTriangles(heights, cells, bound));
}

std::string terrainLayerJson(const Manifest& manifest, const XyzExtent& extent, std::string_view url) {
  const int deepest = deepestTerrainLevel(extent);
  const bool isCrossing = extent.west > extent.east;
  // note: compilers differ on what one value in braces is; array() says it.
  nlohmann::ordered_json available = nlohmann::ordered_json::array();
  for (int z = 0; z <= deepest; ++z) {
    const double side = std::ldexp(180.0, -z);
    const int columns = 2 << z, rows = 1 << z;
    const auto number = [](double place, int most) {
      return std::clamp(static_cast<int>(place), 0, most - 1);
    };
    const int west = number((extent.west + 180.0) / side, columns),
              east = number((extent.east + 180.0) / side, columns);
    const int south = number((extent.south + 90.0) / side, rows),
              north = number((extent.north + 90.0) / side, rows);
    const auto range = [&](int first, int last) {
      return nlohmann::ordered_json{{"startX", first}, {"startY", south}, {"endX", last}, {"endY", north}};
    };
    if (z == 0)
      available.push_back(nlohmann::ordered_json::array({range(0, 1)}));  // CesiumJS wants both
    else if (isCrossing)
      available.push_back(nlohmann::ordered_json::array({range(west, columns - 1), range(0, east)}));
    else
      available.push_back(nlohmann::ordered_json::array({range(west, east)}));
  }
  nlohmann::ordered_json out = {
      {"tilejson", "2.1.0"},
      {"name", manifest.name},
      {"version", "1.0.0"},
      {"format", "quantized-mesh-1.0"},
      {"scheme", "tms"},
      {"projection", "EPSG:4326"},
      {"tiles", nlohmann::ordered_json::array({url})},
      {"extensions", nlohmann::ordered_json::array({"octvertexnormals"})},
      {"minzoom", 0},
      {"maxzoom", deepest},
      {"bounds",
       {isCrossing ? -180.0 : extent.west, extent.south, isCrossing ? 180.0 : extent.east, extent.north}},
      {"available", available}};
  if (!manifest.attribution.empty()) out["attribution"] = manifest.attribution;
  return out.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace terrane::serve
