#include "frustum_lines.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <utility>

namespace terrane {

namespace {

struct Segment {
  glm::dvec3 from;
  glm::dvec3 to;
};

std::vector<Segment> frustumEdges(const FrustumOverlay& overlay) {
  const Camera& seen = overlay.camera;
  const auto corner = [&](int which, double distance) {
    const double x = which == 0 || which == 3 ? -1.0 : 1.0;
    const double y = which < 2 ? -1.0 : 1.0;
    return seen.eyeLocal +
           (seen.forward + seen.right * (x * seen.tanHalfX()) + seen.up * (y * seen.tanHalfY())) * distance;
  };
  std::vector<Segment> out;
  for (int i = 0; i < 4; ++i) {
    out.push_back({seen.eyeLocal, corner(i, overlay.lengthMeters)});
    for (const double share : {0.08, 1.0})
      out.push_back(
          {corner(i, share * overlay.lengthMeters), corner((i + 1) % 4, share * overlay.lengthMeters)});
  }
  return out;
}

}  // namespace

std::vector<LineVertex> makeFrustumLines(const FrustumOverlay& overlay, const Camera& camera,
                                         const DepthRange& depth, double sceneWidthPixels,
                                         double sceneHeightPixels, double widthPixels, float opacity) {
  std::vector<LineVertex> out;
  const double half = 0.5 * widthPixels + 0.5;
  for (const Segment& edge : frustumEdges(overlay)) {
    glm::dvec3 a = camera.viewFromLocal(edge.from);
    glm::dvec3 b = camera.viewFromLocal(edge.to);
    // Only what is in front of the camera can be projected.
    const double nearest = 1.01 * depth.nearMeters;
    if (a.z < nearest && b.z < nearest) continue;
    if (a.z < nearest) a += (b - a) * ((nearest - a.z) / (b.z - a.z));
    if (b.z < nearest) b += (a - b) * ((nearest - b.z) / (a.z - b.z));

    // Widen the line on the screen, then go back to clip space.
    const auto toClip = [&](glm::dvec3 view) {
      const double span = depth.farMeters - depth.nearMeters;
      const double z =
          depth.reversed
              ? depth.nearMeters
              : (view.z * (depth.farMeters + depth.nearMeters) - 2.0 * depth.farMeters * depth.nearMeters) /
                    span;
      return glm::dvec4(view.x / camera.tanHalfX(), view.y / camera.tanHalfY(), z, view.z);
    };
    const glm::dvec4 clipA = toClip(a);
    const glm::dvec4 clipB = toClip(b);
    const glm::dvec2 toPixels(0.5 * sceneWidthPixels, 0.5 * sceneHeightPixels);
    const glm::dvec2 along = (glm::dvec2(clipB) / clipB.w - glm::dvec2(clipA) / clipA.w) * toPixels;
    const double length = glm::length(along);
    if (length < 1e-6) continue;
    const glm::dvec2 across = glm::dvec2(-along.y, along.x) / length * half / toPixels;
    const auto vertex = [&](const glm::dvec4& clip, double side) {
      LineVertex v;
      v.clip = {static_cast<float>(clip.x + side * across.x * clip.w),
                static_cast<float>(clip.y + side * across.y * clip.w), static_cast<float>(clip.z),
                static_cast<float>(clip.w)};
      // note: pixels from the middle must not be foreshortened, so they are the same at both ends.
      v.side = {static_cast<float>(side * half), static_cast<float>(half)};
      v.color = {0.95F, 0.16F, 0.03F, opacity};
      return v;
    };
    for (const auto& [clip, side] : {std::pair{clipA, -1.0}, std::pair{clipA, 1.0}, std::pair{clipB, 1.0},
                                     std::pair{clipA, -1.0}, std::pair{clipB, 1.0}, std::pair{clipB, -1.0}})
      out.push_back(vertex(clip, side));
  }
  return out;
}

}  // namespace terrane
