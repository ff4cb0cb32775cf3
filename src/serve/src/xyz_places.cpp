#include "xyz_places.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::serve {
namespace {

/// Of a pixel: how far places between those that PROJ was asked for may be off.
constexpr double kOff = 0.05;
/// Places along each side of the extent that are looked at.
constexpr int kAlongSide = 32;

glm::dvec2 sampleFromCrs(const Frame& frame, glm::dvec2 crs) {
  return frame.sampleFromLocal(glm::dvec2(frame.localFromCrs({crs, 0.0})));
}
bool isPlace(glm::dvec2 p) {
  return std::isfinite(p.x) && std::isfinite(p.y);
}

/// Longitudes that follow each other around the extent, without the jump at 180 degrees.
double unwrapped(double degrees, double before) {
  return before + std::remainder(degrees - before, 360.0);
}

/// The middle of pixel (col, row), degrees.
glm::dvec2 middleOf(const XyzAddress& tile, double col, double row) {
  const double pixel = std::ldexp(1.0 / kXyzSide, -tile.z);
  return degreesFromMercator(
      {(tile.x * kXyzSide + col + 0.5) * pixel, (tile.y * kXyzSide + row + 0.5) * pixel});
}

/// The side of a square as large as the parallelogram of two vectors.
double widthOf(glm::dvec2 a, glm::dvec2 b) {
  return std::sqrt(std::abs(a.x * b.y - a.y * b.x));
}

class Grid {
 public:
  Grid(const DegreesOf& degreesOf, int side, const XyzExtent& extent, const Frame& frame,
       Geographic& geographic)
      : degreesOf_(degreesOf), side_(side), extent_(extent), frame_(frame), geographic_(geographic) {}

  /// Sample coordinates of places of the lattice; not a number far beside the extent.
  std::vector<glm::dvec2> exact(const std::vector<glm::dvec2>& places) const {
    std::vector<glm::dvec2> out(places.size(), glm::dvec2(std::numeric_limits<double>::quiet_NaN()));
    std::vector<glm::dvec2> degrees;
    std::vector<size_t> asked;
    for (size_t i = 0; i < places.size(); ++i) {
      const glm::dvec2 at = degreesOf_(places[i].x, places[i].y);
      if (!extent_.contains(at, extent_.north - extent_.south)) continue;
      degrees.push_back(at);
      asked.push_back(i);
    }
    const std::vector<glm::dvec2> crs = geographic_.crsFromGeographic(std::span<const glm::dvec2>(degrees));
    for (size_t i = 0; i < asked.size(); ++i)
      if (isPlace(crs[i])) out[asked[i]] = sampleFromCrs(frame_, crs[i]);
    return out;
  }

  /// All places from every `step`th; false where that is not near enough half-way between.
  bool fill(int step, std::vector<glm::dvec2>& out) const {
    const int cells = (side_ - side_ % 2) / step, side = 2 * cells + 1;
    std::vector<glm::dvec2> asked;
    for (int row = 0; row < side; ++row)
      for (int col = 0; col < side; ++col) asked.push_back(glm::dvec2(col, row) * (0.5 * step));
    const std::vector<glm::dvec2> nodes = exact(asked);
    const auto node = [&](int col, int row) { return nodes[static_cast<size_t>(row * side + col)]; };
    for (int row = 0; row < cells; ++row) {
      for (int col = 0; col < cells; ++col) {
        const auto at = [&](int right, int below) { return node(2 * col + right, 2 * row + below); };
        const glm::dvec2 a = at(0, 0), b = at(2, 0), c = at(0, 2), d = at(2, 2);
        const double most = kOff * widthOf(b - a, c - a) / step;
        for (const glm::dvec2 off :
             {at(1, 1) - 0.25 * (a + b + c + d), at(1, 0) - 0.5 * (a + b), at(0, 1) - 0.5 * (a + c),
              at(2, 1) - 0.5 * (b + d), at(1, 2) - 0.5 * (c + d)})
          // note: also false for what is not a number.
          if (!(std::hypot(off.x, off.y) <= most)) return false;
        // The last cells have the last row and column, where the lattice ends with them.
        const int rows = std::min(step + 1, side_ - row * step),
                  columns = std::min(step + 1, side_ - col * step);
        for (int y = 0; y < rows; ++y) {
          for (int x = 0; x < columns; ++x) {
            const double u = static_cast<double>(x) / step, v = static_cast<double>(y) / step;
            out[static_cast<size_t>((row * step + y) * side_ + col * step + x)] =
                (1.0 - v) * ((1.0 - u) * a + u * b) + v * ((1.0 - u) * c + u * d);
          }
        }
      }
    }
    return true;
  }

 private:
  const DegreesOf& degreesOf_;
  int side_;
  const XyzExtent& extent_;
  const Frame& frame_;
  Geographic& geographic_;
};

/// How many samples the smallest pixel is wide, of every 16th there is both ways; nothing where there is
/// none.
std::optional<double> smallestPixel(const std::vector<glm::dvec2>& samples) {
  std::optional<double> out;
  for (size_t row = 8; row < kXyzSide; row += 16) {
    for (size_t col = 8; col < kXyzSide; col += 16) {
      const size_t at = row * kXyzSide + col;
      const double width = widthOf(samples[at + 1] - samples[at], samples[at + kXyzSide] - samples[at]);
      if (std::isfinite(width) && width > 0.0) out = std::min(width, out.value_or(width));
    }
  }
  return out;
}

}  // namespace

bool XyzExtent::contains(glm::dvec2 degrees, double beside) const {
  if (!(degrees.y >= south - beside && degrees.y <= north + beside)) return false;
  const bool isEastOfWest = degrees.x >= west - beside, isWestOfEast = degrees.x <= east + beside;
  return west <= east ? isEastOfWest && isWestOfEast : isEastOfWest || isWestOfEast;
}

bool XyzExtent::meets(const XyzAddress& tile) const {
  const double side = std::ldexp(1.0, -tile.z);
  const glm::dvec2 northWest = degreesFromMercator(glm::dvec2(tile.x, tile.y) * side);
  const glm::dvec2 southEast = degreesFromMercator(glm::dvec2(tile.x + 1, tile.y + 1) * side);
  if (southEast.y > north || northWest.y < south) return false;
  const bool isEastOfWest = southEast.x >= west, isWestOfEast = northWest.x <= east;
  return west <= east ? isEastOfWest && isWestOfEast : isEastOfWest || isWestOfEast;
}

int XyzExtent::zoomFor(int finer) const {
  return std::clamp(static_cast<int>(std::ceil(std::log2(samplesOfRoot) + finer - 1e-6)), 0, kDeepestXyz);
}

std::optional<XyzExtent> xyzExtentOf(const Manifest& manifest, Geographic& geographic) {
  const Frame& frame = manifest.frame;
  const glm::dvec2 corner(static_cast<double>(manifest.extentCols - 1),
                          static_cast<double>(manifest.extentRows - 1));
  const auto crsOf = [&](glm::dvec2 sample) {
    return glm::dvec2(frame.crsFromLocal({frame.localFromSample(sample), 0.0}));
  };
  // Once around the edge, from the middle of the data, which is asked for last.
  std::vector<glm::dvec2> places;
  const glm::dvec2 turns[] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}};
  for (int leg = 0; leg < 4; ++leg)
    for (int i = 0; i < kAlongSide; ++i)
      places.push_back(crsOf(
          (turns[leg] + (turns[leg + 1] - turns[leg]) * (static_cast<double>(i) / kAlongSide)) * corner));
  places.push_back(places.front());
  places.push_back(crsOf(0.5 * corner));
  const std::vector<glm::dvec2> degrees = geographic.geographicFromCrs(std::span<const glm::dvec2>(places));
  const glm::dvec2 middle = degrees.back();
  if (!isPlace(middle)) return std::nullopt;

  XyzExtent out;
  double low = middle.x, high = middle.x, longitude = middle.x, around = 0.0;
  out.south = out.north = middle.y;
  std::optional<double> first;
  for (size_t i = 0; i + 1 < degrees.size(); ++i) {
    if (!isPlace(degrees[i])) continue;
    const double next = unwrapped(degrees[i].x, longitude);
    if (first) around += next - longitude;
    first = first.value_or(next);
    longitude = next;
    low = std::min(low, next);
    high = std::max(high, next);
    out.south = std::min(out.south, degrees[i].y);
    out.north = std::max(out.north, degrees[i].y);
  }
  if (std::abs(around) > 180.0) {
    // The edge goes around a pole.
    (middle.y > 0.0 ? out.north : out.south) = middle.y > 0.0 ? 90.0 : -90.0;
    low = -180.0;
    high = 180.0;
  }
  const bool isAllAround = high - low >= 360.0;
  out.west = isAllAround ? -180.0 : std::remainder(low, 360.0);
  out.east = isAllAround ? 180.0 : std::remainder(high, 360.0);
  if (out.south > kMercatorLatitude || out.north < -kMercatorLatitude) return std::nullopt;
  out.south = std::max(out.south, -kMercatorLatitude);
  out.north = std::min(out.north, kMercatorLatitude);

  // How wide a small step in the square is there.
  constexpr double kStep = 1e-7;
  const glm::dvec2 at = mercatorFromDegrees({middle.x, std::clamp(middle.y, out.south, out.north)});
  const std::vector<glm::dvec2> steps = {degreesFromMercator(at),
                                         degreesFromMercator(at + glm::dvec2(kStep, 0.0)),
                                         degreesFromMercator(at + glm::dvec2(0.0, kStep))};
  const std::vector<glm::dvec2> ends = geographic.crsFromGeographic(std::span<const glm::dvec2>(steps));
  if (!isPlace(ends[0]) || !isPlace(ends[1]) || !isPlace(ends[2])) return std::nullopt;
  const glm::dvec2 origin = sampleFromCrs(frame, ends[0]);
  const glm::dvec2 east = sampleFromCrs(frame, ends[1]) - origin,
                   south = sampleFromCrs(frame, ends[2]) - origin;
  out.samplesOfRoot = std::sqrt(std::abs(east.x * south.y - east.y * south.x)) / kStep / kXyzSide;
  return out;
}

std::vector<glm::dvec2> samplesOfLattice(int side, const DegreesOf& degreesOf, const XyzExtent& extent,
                                         const Frame& frame, Geographic& geographic) {
  std::vector<glm::dvec2> out(static_cast<size_t>(side) * static_cast<size_t>(side));
  const Grid grid(degreesOf, side, extent, frame, geographic);
  if (!grid.fill(16, out) && !grid.fill(4, out)) {
    std::vector<glm::dvec2> all;
    for (int row = 0; row < side; ++row)
      for (int col = 0; col < side; ++col) all.emplace_back(col, row);
    out = grid.exact(all);
  }
  // note: far from where a projection is meant for, it may give places that are those of somewhere else.
  for (int row = 0; row < side; ++row)
    for (int col = 0; col < side; ++col)
      if (!extent.contains(degreesOf(col, row)))
        out[static_cast<size_t>(row * side + col)] = glm::dvec2(std::numeric_limits<double>::quiet_NaN());
  return out;
}

XyzPlaces xyzPlacesOf(const XyzAddress& tile, const XyzExtent& extent, const Frame& frame,
                      Geographic& geographic) {
  const auto middles = [&](double col, double row) { return middleOf(tile, col, row); };
  XyzPlaces out;
  out.samples = samplesOfLattice(kXyzSide, middles, extent, frame, geographic);
  out.samplesAPixel = smallestPixel(out.samples).value_or(std::ldexp(extent.samplesOfRoot, -tile.z));
  return out;
}

}  // namespace terrane::serve
