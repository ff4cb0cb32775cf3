#include "web_mercator.h"

#include <charconv>
#include <cmath>
#include <numbers>

namespace terrane::serve {
namespace {

std::optional<int> readAxis(std::string_view text) {
  int number = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  if (error != std::errc{} || end != last || number < 0 || text.front() == '-') return {};
  return number;
}

}  // namespace

std::optional<XyzAddress> readXyz(std::string_view z, std::string_view x, std::string_view y) {
  const auto level = readAxis(z), col = readAxis(x), row = readAxis(y);
  if (!level || !col || !row || *level > kDeepestXyz) return {};
  if (*col >> *level != 0 || *row >> *level != 0) return {};
  return XyzAddress{*level, *col, *row};
}

glm::dvec2 degreesFromMercator(glm::dvec2 place) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  return {360.0 * place.x - 180.0, kDegrees * std::atan(std::sinh(std::numbers::pi * (1.0 - 2.0 * place.y)))};
}

glm::dvec2 mercatorFromDegrees(glm::dvec2 degrees) {
  const double latitude = std::numbers::pi / 180.0 * degrees.y;
  return {degrees.x / 360.0 + 0.5, 0.5 - std::asinh(std::tan(latitude)) / (2.0 * std::numbers::pi)};
}

}  // namespace terrane::serve
