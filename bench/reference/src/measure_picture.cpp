#include "terrane/reference/measure_picture.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <mutex>
#include <thread>

#include "terrane/base/check.h"

namespace terrane {
namespace {

constexpr int kHistogramPixels = 100;
constexpr size_t kPlacesListed = 16;

/// Calls work(row, part) for all rows, on all cores, each core with a part of its own; then join(part) for
/// each part, one at a time.
template <class Part, class Work, class Join>
void forAllRows(int rows, const Work& work, const Join& join) {
  std::atomic<int> next{0};
  std::mutex joining;
  const auto run = [&] {
    Part part;
    for (int row = next++; row < rows; row = next++) work(row, part);
    const std::lock_guard lock(joining);
    join(part);
  };
  std::vector<std::thread> helpers;
  for (unsigned i = 1; i < std::max(1U, std::thread::hardware_concurrency()); ++i) helpers.emplace_back(run);
  run();
  for (std::thread& helper : helpers) helper.join();
}

void checkSize(const Camera& camera, std::span<const glm::dvec3> places) {
  TERRANE_CHECK(places.size() == static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height),
                "{} places for {} x {} pixels", places.size(), camera.width, camera.height);
}

bool isSky(glm::dvec3 place) {
  return std::isnan(place.z);
}

/// The view depth of the reference under each pixel of the picture and of a margin around it; infinite where
/// there is sky.
struct DepthPicture {
  int margin = 0;
  int width = 0;  ///< with both margins
  int height = 0;
  std::vector<double> depths;
  double at(int x, int y) const {
    return depths[static_cast<size_t>(y + margin) * static_cast<size_t>(width) +
                  static_cast<size_t>(x + margin)];
  }
};

DepthPicture castPicture(const ReferenceSurface& surface, const Camera& camera, int margin) {
  DepthPicture picture{margin, camera.width + 2 * margin, camera.height + 2 * margin, {}};
  picture.depths.resize(static_cast<size_t>(picture.width) * static_cast<size_t>(picture.height));
  struct Nothing {};
  forAllRows<Nothing>(
      picture.height,
      [&](int row, Nothing&) {
        for (int col = 0; col < picture.width; ++col) {
          // The ray has depth 1 in its length, so that the distance in its lengths is the depth.
          const glm::dvec3 ray = camera.rayThroughPixel({col - margin + 0.5, row - margin + 0.5});
          const auto hit = surface.cast(camera.eyeLocal, ray);
          picture.depths[static_cast<size_t>(row) * static_cast<size_t>(picture.width) +
                         static_cast<size_t>(col)] =
              hit && hit->fromAbove ? hit->distance : std::numeric_limits<double>::infinity();
        }
      },
      [](Nothing&) {});
  return picture;
}

/// The largest depth within `reach` pixels of one; infinite where any of them is sky.
double farthestAround(const DepthPicture& picture, int x, int y, int reach) {
  double farthest = 0.0;
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) farthest = std::max(farthest, picture.at(x + dx, y + dy));
  }
  return farthest;
}

/// Is all the ground that the reference shows within `reach` pixels, and between those, free of holes? A hole
/// may be too small for any pixel's middle, and still be what a pixel shows.
bool isAllGroundAround(const ReferenceSurface& surface, const Camera& camera, const DepthPicture& picture,
                       int x, int y, int reach) {
  glm::dvec2 low(std::numeric_limits<double>::infinity());
  glm::dvec2 high(-std::numeric_limits<double>::infinity());
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const glm::dvec3 ray = camera.rayThroughPixel({x + dx + 0.5, y + dy + 0.5});
      const glm::dvec3 point = camera.eyeLocal + picture.at(x + dx, y + dy) * ray;
      low = glm::min(low, glm::dvec2(point.x, point.y));
      high = glm::max(high, glm::dvec2(point.x, point.y));
    }
  }
  return surface.isAllGround(low, high);
}

/// Does the reference hide, from the camera, its own point on the vertical of a drawn one?
bool isBehindGround(const ReferenceSurface& surface, const Camera& camera, glm::dvec3 drawn) {
  const auto height = surface.heightAt({drawn.x, drawn.y});
  if (!height) return false;
  const glm::dvec3 truth(drawn.x, drawn.y, *height);
  const auto hit = surface.cast(camera.eyeLocal, truth - camera.eyeLocal);
  return hit && hit->fromAbove && hit->distance < 1.0 - 1e-6;
}

}  // namespace

double ErrorMeasure::rms() const {
  return pixels > 0 ? std::sqrt(sumOfSquares / static_cast<double>(pixels)) : 0.0;
}

double ErrorMeasure::fractionAboveTau() const {
  return pixels > 0 ? static_cast<double>(aboveTau) / static_cast<double>(pixels) : 0.0;
}

double ErrorMeasure::percentile999() const {
  const double allowed = 0.001 * static_cast<double>(pixels);
  int64_t above = 0;
  for (size_t bin = histogram.size(); bin-- > 0;) {
    above += histogram[bin];
    if (static_cast<double>(above) > allowed)
      return std::min(maxPixels, static_cast<double>(bin + 1) / kBinsPerPixel);
  }
  return 0.0;
}

void ErrorMeasure::add(const ErrorMeasure& other) {
  if (other.maxPixels > maxPixels) {
    maxPixels = other.maxPixels;
    maxAt = other.maxAt;
    maxPoint = other.maxPoint;
  }
  pixels += other.pixels;
  sumOfSquares += other.sumOfSquares;
  aboveTau += other.aboveTau;
  excessPixels += other.excessPixels;
  histogram.resize(std::max(histogram.size(), other.histogram.size()), 0);
  for (size_t bin = 0; bin < other.histogram.size(); ++bin) histogram[bin] += other.histogram[bin];
}

ErrorMeasure measureError(const ReferenceSurface& surface, const Camera& camera,
                          std::span<const glm::dvec3> places, double tauPixels) {
  checkSize(camera, places);
  ErrorMeasure total;
  forAllRows<ErrorMeasure>(
      camera.height,
      [&](int row, ErrorMeasure& part) {
        part.histogram.resize(kHistogramPixels * ErrorMeasure::kBinsPerPixel + 1, 0);
        for (int col = 0; col < camera.width; ++col) {
          const glm::dvec3 drawn =
              places[static_cast<size_t>(row) * static_cast<size_t>(camera.width) + static_cast<size_t>(col)];
          if (isSky(drawn)) continue;
          const auto height = surface.heightAt({drawn.x, drawn.y});
          if (!height) continue;

          // Ground that is in truth behind the camera is as wrong as a picture can be.
          const glm::dvec3 truth(drawn.x, drawn.y, *height);
          double error = std::hypot(camera.width, camera.height);
          if (camera.viewFromLocal(truth).z > 0.0) {
            error = std::min(error, glm::length(camera.pixelFromLocal(truth) - camera.pixelFromLocal(drawn)));
          }
          ++part.pixels;
          part.sumOfSquares += error * error;
          if (error > tauPixels) ++part.aboveTau;
          part.excessPixels += std::max(0.0, error - tauPixels);
          const auto bin = static_cast<size_t>(error * ErrorMeasure::kBinsPerPixel);
          ++part.histogram[std::min(bin, part.histogram.size() - 1)];
          if (error > part.maxPixels) {
            part.maxPixels = error;
            part.maxAt = {col, row};
            part.maxPoint = drawn;
          }
        }
      },
      [&](const ErrorMeasure& part) { total.add(part); });
  return total;
}

void CrackMeasure::add(const CrackMeasure& other) {
  skyPixels += other.skyPixels;
  cracks += other.cracks;
  seeThrough += other.seeThrough;
  checked += other.checked;
  for (const glm::ivec2 place : other.where) {
    if (where.size() < kPlacesListed) where.push_back(place);
  }
}

CrackMeasure measureCracks(const ReferenceSurface& surface, const Camera& camera,
                           std::span<const glm::dvec3> places, double tauPixels) {
  checkSize(camera, places);
  const int outlineReach = static_cast<int>(std::ceil(tauPixels)) + 1;
  const int depthReach = 2 * static_cast<int>(std::ceil(tauPixels)) + 1;
  const DepthPicture reference = castPicture(surface, camera, depthReach);
  CrackMeasure total;
  forAllRows<CrackMeasure>(
      camera.height,
      [&](int row, CrackMeasure& part) {
        for (int col = 0; col < camera.width; ++col) {
          const glm::dvec3 drawn =
              places[static_cast<size_t>(row) * static_cast<size_t>(camera.width) + static_cast<size_t>(col)];
          const double here = reference.at(col, row);
          if (isSky(drawn)) ++part.skyPixels;
          if (!std::isfinite(here)) continue;
          ++part.checked;
          if (isSky(drawn)) {
            if (!std::isfinite(farthestAround(reference, col, row, outlineReach))) continue;
            if (!isAllGroundAround(surface, camera, reference, col, row, outlineReach)) continue;
            ++part.cracks;
            if (part.where.size() < kPlacesListed) part.where.push_back({col, row});
          } else {
            if (isBehindGround(surface, camera, drawn) &&
                camera.viewFromLocal(drawn).z > farthestAround(reference, col, row, depthReach) &&
                isAllGroundAround(surface, camera, reference, col, row, depthReach)) {
              ++part.seeThrough;
            }
          }
        }
      },
      [&](const CrackMeasure& part) { total.add(part); });
  return total;
}

CrackMeasure measureCracksWhileLoading(const ReferenceSurface::Cover& cover, const Camera& camera,
                                       std::span<const glm::dvec3> places) {
  checkSize(camera, places);
  CrackMeasure total;
  forAllRows<CrackMeasure>(
      camera.height,
      [&](int row, CrackMeasure& part) {
        for (int col = 0; col < camera.width; ++col) {
          const glm::dvec3 drawn =
              places[static_cast<size_t>(row) * static_cast<size_t>(camera.width) + static_cast<size_t>(col)];
          if (isSky(drawn)) ++part.skyPixels;
          if (!cover.mustHit(camera.eyeLocal, camera.rayThroughPixel({col + 0.5, row + 0.5}))) continue;
          ++part.checked;
          if (!isSky(drawn)) continue;
          ++part.cracks;
          if (part.where.size() < kPlacesListed) part.where.push_back({col, row});
        }
      },
      [&](const CrackMeasure& part) { total.add(part); });
  return total;
}

}  // namespace terrane
