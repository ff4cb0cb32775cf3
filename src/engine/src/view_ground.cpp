#include "view_ground.h"

#include <algorithm>
#include <limits>

namespace terrane {
namespace {

/// Coarse ground, and what fills voids, may lie a little outside of the range that the manifest tells.
constexpr double kRangeMarginMeters = 1.0;

std::optional<double> orNothing(const Result<std::optional<double>>& answer) {
  return answer.ok() ? *answer : std::nullopt;
}

}  // namespace

Result<std::shared_ptr<const Tile>> ViewGround::get(TileId id, const Tile*) {
  return stream_.elevation(id);
}

std::optional<double> heightHere(ViewGround& ground, glm::dvec2 local) {
  if (!ground.isReady()) return {};
  return orNothing(Surface(ground).heightAt(ground.manifest().frame.sampleFromLocal(local)));
}

std::optional<double> errorHere(ViewGround& ground, glm::dvec2 local) {
  if (!ground.isReady()) return {};
  return orNothing(Surface(ground).errorAt(ground.manifest().frame.sampleFromLocal(local)));
}

std::optional<glm::dvec3> pickGround(ViewGround& ground, const Camera& camera, double exaggeration,
                                     glm::dvec2 pixel) {
  if (!ground.isReady()) return {};
  const Manifest& manifest = ground.manifest();
  const Frame& frame = manifest.frame;
  const glm::dvec3 eye = camera.eyeLocal, ray = camera.rayThroughPixel(pixel);

  // The part of the ray that is over the world and within the range of heights.
  double begin = 0.0, end = std::numeric_limits<double>::infinity();
  const auto clip = [&](double from, double step, double low, double high) {
    if (step == 0.0) {
      if (from < low || from > high) end = -1.0;
      return;
    }
    const double a = (low - from) / step, b = (high - from) / step;
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  };
  const glm::dvec2 corner = frame.localFromSample(glm::dvec2(static_cast<double>(frame.worldCells())));
  const double margin = manifest.maxErrorMeters + kRangeMarginMeters;
  clip(eye.x, ray.x, 0.0, corner.x);
  clip(eye.y, ray.y, corner.y, 0.0);
  clip(eye.z, ray.z, exaggeration * (manifest.minHeight - margin),
       exaggeration * (manifest.maxHeight + margin));
  if (!(begin <= end)) return {};

  // In sample coordinates and without exaggeration it is a straight line, too.
  const auto place = [&](double depth) {
    const glm::dvec3 local = eye + depth * ray;
    return glm::dvec3(frame.sampleFromLocal(glm::dvec2(local)), local.z / exaggeration);
  };
  const glm::dvec3 from = place(begin), to = place(end);
  const auto hit = Surface(ground).firstHit(from, to);
  if (!hit.ok() || !*hit) return {};
  const glm::dvec3 found = from + (*hit)->share * (to - from);
  return glm::dvec3(frame.localFromSample(glm::dvec2(found)), (*hit)->height);
}

}  // namespace terrane
