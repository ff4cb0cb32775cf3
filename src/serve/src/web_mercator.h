#pragma once

#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <string_view>

/// The tiles of web maps: the square of web Mercator (EPSG:3857), halved z times, column x from the west, row
/// y from the north.
namespace terrane::serve {

inline constexpr int kXyzSide = 256;  ///< pixels
inline constexpr int kDeepestXyz = 24;
/// Beyond these the square has nothing.
inline constexpr double kMercatorLatitude = 85.0511287798066;

struct XyzAddress {
  int z = 0;
  int x = 0;
  int y = 0;
};

/// From the segments "12", "2134", "1452" (the file's ending is off already). Nothing for what is no address.
std::optional<XyzAddress> readXyz(std::string_view z, std::string_view x, std::string_view y);

/// Longitude and latitude, degrees, of a place in the unit square: x from the west, y from the north.
glm::dvec2 degreesFromMercator(glm::dvec2 place);
glm::dvec2 mercatorFromDegrees(glm::dvec2 degrees);

}  // namespace terrane::serve
