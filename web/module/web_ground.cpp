#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "terrane/engine/line_of_sight.h"
#include "terrane/engine/surface_profile.h"
#include "web_view.h"

/// Questions of pages about the ground that is here.
namespace terrane {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
/// A line of sight crosses no more triangles than this: some 20 ms.
constexpr size_t kMostPieces = 500000;
/// Heights of one profile.
constexpr double kMostPoints = 100000.0;

}  // namespace

glm::dvec2 WebView::sampleOf(double easting, double northing) const {
  const Frame& frame = view_->manifest().frame;
  return frame.sampleFromLocal(glm::dvec2(frame.localFromCrs({easting, northing, 0.0})));
}

double WebView::elevationAt(double easting, double northing) const {
  if (!isReady()) return kNothing;
  const glm::dvec3 local = view_->manifest().frame.localFromCrs({easting, northing, 0.0});
  return view_->heightAt(glm::dvec2(local)).value_or(kNothing);
}

double WebView::elevationErrorAt(double easting, double northing) const {
  if (!isReady()) return kNothing;
  const glm::dvec3 local = view_->manifest().frame.localFromCrs({easting, northing, 0.0});
  return view_->errorAt(glm::dvec2(local)).value_or(kNothing);
}

emscripten::val WebView::pick(double x, double y) {
  numbers_.clear();
  if (isReady() && width_ > 0 && height_ > 0) {
    const Camera seen = camera();
    if (const auto found = view_->pick(seen, {x, y})) {
      const glm::dvec3 crs = view_->manifest().frame.crsFromLocal(*found);
      const glm::dvec3 drawn(found->x, found->y, found->z * style_.exaggeration);
      numbers_ = {crs.x, crs.y, crs.z, glm::length(drawn - seen.eyeLocal)};
    }
  }
  return numbers();
}

emscripten::val WebView::profile(const emscripten::val& corners, double count) {
  numbers_.clear();
  const auto places = emscripten::convertJSArrayToNumberVector<double>(corners);
  if (!isReady() || places.size() < 2 || !(count >= 1.0)) return numbers();
  std::vector<glm::dvec2> samples;
  for (size_t i = 0; i + 1 < places.size(); i += 2) samples.push_back(sampleOf(places[i], places[i + 1]));
  const Frame& frame = view_->manifest().frame;
  Surface surface = view_->surface();
  const auto points =
      profileAlong(surface, frame, samples, static_cast<size_t>(std::min(count, kMostPoints)));
  if (!points.ok()) return numbers();
  for (const ProfilePoint& point : *points) {
    const glm::dvec3 crs = frame.crsFromLocal({frame.localFromSample(point.sample), 0.0});
    numbers_.insert(numbers_.end(), {point.distanceMeters, crs.x, crs.y, point.height.value_or(kNothing),
                                     point.errorMeters.value_or(kNothing)});
  }
  return numbers();
}

emscripten::val WebView::lineOfSight(double fromEast, double fromNorth, double fromAboveGround, double toEast,
                                     double toNorth, double toAboveGround, double refraction,
                                     double lengthMeters) {
  numbers_ = {kNothing, kNothing};
  if (!isReady()) return numbers();
  const Frame& frame = view_->manifest().frame;
  const glm::dvec2 from = sampleOf(fromEast, fromNorth), to = sampleOf(toEast, toNorth);
  Surface surface = view_->surface();
  const auto fromGround = surface.heightAt(from), toGround = surface.heightAt(to);
  if (!fromGround.ok() || !*fromGround || !toGround.ok() || !*toGround) return numbers();
  const auto pieces = surface.along(from, to, kMostPieces);
  if (!pieces.ok()) return numbers();

  SightLine line;
  line.fromHeight = **fromGround + fromAboveGround;
  line.toHeight = **toGround + toAboveGround;
  line.lengthMeters = lengthMeters >= 0.0 ? lengthMeters : metersBetween(frame, from, to);
  if (refraction >= 0.0 && refraction < 1.0)
    line.radiusMeters = sightRadiusMeters(refraction, ellipsoidOf(view_->manifest().crsWkt));
  const SightResult seen = lookAlong(*pieces, line);
  numbers_[0] = seen.visible ? 1.0 : 0.0;
  numbers_[1] = seen.clearanceMeters.value_or(kNothing);
  if (seen.blockedAt) {
    const glm::dvec2 place = frame.localFromSample(from + *seen.blockedAt * (to - from));
    const glm::dvec3 crs = frame.crsFromLocal({place, seen.blockedHeight});
    numbers_.insert(numbers_.end(), {crs.x, crs.y, crs.z});
  }
  return numbers();
}

void WebView::studyGround(const emscripten::val& corners, const emscripten::val& counts) {
  if (!isReady()) return;
  const auto places = emscripten::convertJSArrayToNumberVector<double>(corners);
  const Frame& frame = view_->manifest().frame;
  std::vector<std::vector<glm::dvec2>> lines;
  size_t at = 0;
  for (const double count : emscripten::convertJSArrayToNumberVector<double>(counts)) {
    auto& line = lines.emplace_back();
    for (double i = 0.0; i < count && at + 1 < places.size(); ++i, at += 2)
      line.emplace_back(frame.localFromCrs({places[at], places[at + 1], 0.0}));
  }
  view_->studyGround(std::move(lines));
}

}  // namespace terrane
