#include "terrane/dataset/ellipsoid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>

namespace terrane {
namespace {

constexpr std::string_view kSpace = " \t\r\n";
/// Bodies that somebody stands on: from small moons to large planets, metres.
constexpr double kSmallest = 100.0, kLargest = 1e9;

void skipSpace(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
}

bool skip(std::string_view& text, char expected) {
  skipSpace(text);
  if (text.empty() || text.front() != expected) return false;
  text.remove_prefix(1);
  return true;
}

/// A quoted name, in which "" stands for a quote: as long as whole quoted pieces follow each other.
bool skipName(std::string_view& text) {
  skipSpace(text);
  bool any = false;
  while (!text.empty() && text.front() == '"') {
    const size_t end = text.find('"', 1);
    if (end == text.npos) return false;
    text.remove_prefix(end + 1);
    any = true;
  }
  return any;
}

std::optional<double> takeNumber(std::string_view& text) {
  skipSpace(text);
  // note: emscripten's std::from_chars knows no doubles. No number of a WKT has as many digits as that.
  const std::string digits(text.substr(0, 64));
  char* end = nullptr;
  const double number = std::strtod(digits.c_str(), &end);
  if (end == digits.c_str() || !std::isfinite(number)) return std::nullopt;
  text.remove_prefix(static_cast<size_t>(end - digits.c_str()));
  return number;
}

/// `text` begins behind the keyword: ["name", 6378137, 298.257223563, LENGTHUNIT["metre", 1]].
std::optional<Ellipsoid> takeEllipsoid(std::string_view text) {
  if ((!skip(text, '[') && !skip(text, '(')) || !skipName(text) || !skip(text, ',')) return std::nullopt;
  const auto semiMajor = takeNumber(text);
  if (!semiMajor || !skip(text, ',')) return std::nullopt;
  const auto inverse = takeNumber(text);
  if (!inverse) return std::nullopt;
  double unit = 1.0;
  constexpr std::string_view kUnit = "LENGTHUNIT";
  if (skip(text, ',')) {
    skipSpace(text);
    if (text.starts_with(kUnit)) {
      text.remove_prefix(kUnit.size());
      if ((skip(text, '[') || skip(text, '(')) && skipName(text) && skip(text, ','))
        unit = takeNumber(text).value_or(1.0);
    }
  }
  Ellipsoid out{*semiMajor * unit, *inverse == 0.0 ? 0.0 : 1.0 / *inverse};
  const bool isBody = out.semiMajorMeters >= kSmallest && out.semiMajorMeters <= kLargest;
  if (!isBody || !(out.flattening >= 0.0 && out.flattening < 0.9)) return std::nullopt;
  return out;
}

}  // namespace

Ellipsoid ellipsoidOf(std::string_view crsWkt) {
  for (const std::string_view keyword : std::array<std::string_view, 2>{"ELLIPSOID", "SPHEROID"}) {
    for (size_t at = crsWkt.find(keyword); at != crsWkt.npos; at = crsWkt.find(keyword, at + 1)) {
      if (const auto found = takeEllipsoid(crsWkt.substr(at + keyword.size()))) return *found;
    }
  }
  return {};
}

}  // namespace terrane
