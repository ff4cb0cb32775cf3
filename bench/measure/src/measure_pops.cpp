#include "terrane/measure/measure_pops.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "terrane/base/parallel.h"

namespace terrane {
namespace {

bool inWindow(const Camera& camera, glm::dvec3 point) {
  if (camera.viewFromLocal(point).z <= 0.0) return false;
  const glm::dvec2 pixel = camera.pixelFromLocal(point);
  return pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x <= camera.width && pixel.y <= camera.height;
}

void measureRow(const DrawnFrame& before, const DrawnFrame& now, std::span<const glm::dvec3> row,
                PopMeasure& out) {
  for (const glm::dvec3& place : row) {
    if (std::isnan(place.z)) continue;
    const glm::dvec2 at{place.x, place.y};
    const std::optional<double> height = now.surface.heightAt(at);
    if (!height) continue;  // the place's own roundings have led past the world's or the cut's border
    const glm::dvec3 point{at, *height};
    const glm::dvec2 pixel = now.camera.pixelFromLocal(point);
    out.offSurface = std::max(out.offSurface, glm::length(pixel - now.camera.pixelFromLocal(place)));
    const std::optional<double> was = before.surface.heightAt(at);
    const glm::dvec3 pointBefore{at, was.value_or(*height)};
    // What was out of view has not been seen to move.
    if (!inWindow(before.camera, pointBefore) || !inWindow(now.camera, pointBefore)) continue;
    if (!was) {
      ++out.missing;
      continue;
    }
    const double pop = glm::length(pixel - now.camera.pixelFromLocal(pointBefore));
    ++out.pixels;
    if (pop > 0.5) ++out.aboveHalf;
    if (pop > out.maxPixels) {
      out.maxPixels = pop;
      out.maxPoint = point;
    }
    const auto bin = static_cast<size_t>(std::min(pop * PopMeasure::kBinsPerPixel, 1e5));
    if (out.histogram.size() <= bin) out.histogram.resize(bin + 1);
    ++out.histogram[bin];
  }
}

}  // namespace

double PopMeasure::percentile999() const {
  int64_t left = pixels / 1000;
  for (size_t bin = histogram.size(); bin-- > 0;) {
    left -= histogram[bin];
    if (left < 0) return static_cast<double>(bin + 1) / kBinsPerPixel;
  }
  return 0.0;
}

void PopMeasure::add(const PopMeasure& other) {
  pixels += other.pixels;
  aboveHalf += other.aboveHalf;
  missing += other.missing;
  offSurface = std::max(offSurface, other.offSurface);
  if (other.maxPixels > maxPixels) {
    maxPixels = other.maxPixels;
    maxPoint = other.maxPoint;
  }
  if (histogram.size() < other.histogram.size()) histogram.resize(other.histogram.size());
  for (size_t i = 0; i < other.histogram.size(); ++i) histogram[i] += other.histogram[i];
}

PopMeasure measurePops(const DrawnFrame& before, const DrawnFrame& now, std::span<const glm::dvec3> places) {
  const auto width = static_cast<size_t>(now.camera.width);
  std::vector<PopMeasure> rows(static_cast<size_t>(now.camera.height));
  parallelFor(static_cast<int64_t>(rows.size()), 0, [&](int64_t index) {
    const auto y = static_cast<size_t>(index);
    measureRow(before, now, places.subspan(y * width, width), rows[y]);
  });
  PopMeasure out;
  for (const PopMeasure& row : rows) out.add(row);
  return out;
}

}  // namespace terrane
