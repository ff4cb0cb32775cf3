#include "terrane/engine/surface_profile.h"

#include <cmath>

namespace terrane {

double metersBetween(const Frame& frame, glm::dvec2 a, glm::dvec2 b) {
  const glm::dvec2 d = frame.localFromSample(b) - frame.localFromSample(a);
  return std::hypot(d.x, d.y);
}

Result<std::vector<ProfilePoint>> profileAlong(Surface& surface, const Frame& frame,
                                               std::span<const glm::dvec2> corners, size_t count) {
  std::vector<double> ends{0.0};  // of the legs, metres from the beginning
  for (size_t i = 1; i < corners.size(); ++i)
    ends.push_back(ends.back() + metersBetween(frame, corners[i - 1], corners[i]));
  std::vector<ProfilePoint> out;
  size_t leg = 1;
  for (size_t i = 0; i < count; ++i) {
    ProfilePoint point{ends.back(), corners.back(), corners.size() > 1 ? corners.size() - 2 : 0, {}, {}};
    if (i + 1 < count && corners.size() > 1) {
      point.distanceMeters = ends.back() * static_cast<double>(i) / static_cast<double>(count - 1);
      while (leg + 1 < corners.size() && ends[leg] < point.distanceMeters) ++leg;
      const double length = ends[leg] - ends[leg - 1];
      const double share = length > 0.0 ? (point.distanceMeters - ends[leg - 1]) / length : 0.0;
      point.sample = corners[leg - 1] + share * (corners[leg] - corners[leg - 1]);
      point.leg = leg - 1;
    }
    TERRANE_ASSIGN(point.height, surface.heightAt(point.sample));
    TERRANE_ASSIGN(point.errorMeters, surface.errorAt(point.sample));
    out.push_back(point);
  }
  return out;
}

}  // namespace terrane
