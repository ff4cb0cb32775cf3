#include "terrane/engine/default_style.h"

#include <algorithm>
#include <cstdlib>
#include <string>

namespace terrane {
namespace {

/// Of the root's samples: less of them at 0 are no sea.
constexpr double kLeastSea = 0.005;

/// The water level that a dataset seems to have: its sea stands at 0 where much of the ground does, or in
/// older datasets, which do not tell, when the lowest ground is about there.
std::optional<double> seaLevel(const Manifest& manifest) {
  if (manifest.zeroShare) return *manifest.zeroShare >= kLeastSea ? std::optional(0.0) : std::nullopt;
  if (manifest.minHeight > 0.0 || manifest.minHeight < -450.0 || manifest.maxHeight < 5.0)
    return std::nullopt;
  return 0.0;
}

/// Somewhere without meadows: an ellipsoid that is not about the Earth's size.
bool isBareWorld(const Manifest& manifest) {
  const size_t ellipsoid = manifest.crsWkt.find("ELLIPSOID[\"");
  const size_t comma =
      ellipsoid == std::string::npos ? ellipsoid : manifest.crsWkt.find("\",", ellipsoid + 11);
  if (comma == std::string::npos) return false;
  const double radiusMeters = std::atof(manifest.crsWkt.c_str() + comma + 2);
  return radiusMeters > 0.0 && (radiusMeters < 6.3e6 || radiusMeters > 6.45e6);
}

}  // namespace

RenderStyle defaultStyle(const Manifest& manifest) {
  RenderStyle style;
  style.lowMeters = manifest.minHeight;
  style.highMeters = std::max(manifest.maxHeight, manifest.minHeight + 1.0);
  style.palette = isBareWorld(manifest) ? Palette::grey() : Palette::forGround(manifest.maxHeight);
  style.waterLevelMeters = seaLevel(manifest);
  // A level sea: what lies lower, behind dikes or in a desert, is dry.
  if (manifest.zeroShare) style.waterWithinMeters = std::max(manifest.maxErrorMeters, 0.05);
  return style;
}

}  // namespace terrane
