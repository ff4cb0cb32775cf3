#include "terrane/lod/screen_metric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <random>

namespace terrane {
namespace {

struct Scene {
  std::mt19937 random;
  explicit Scene(uint32_t seed) : random(seed) {}
  double unit(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }

  Camera camera() {
    const glm::dvec3 eye(unit(-500, 500), unit(-500, 500), unit(1, 800));
    const glm::dvec3 target(unit(-800, 800), unit(-800, 800), unit(-200, 600));
    Camera out = lookAt(eye, target, unit(0.3, 2.0), 640, 360);
    // Some cameras are rolled.
    if (random() % 3 == 0) {
      const double angle = unit(-1, 1);
      const glm::dvec3 right = out.right * std::cos(angle) + out.up * std::sin(angle);
      out.up = glm::cross(right, out.forward);
      out.right = right;
    }
    return out;
  }
  Prism prism() {
    const double extent = std::exp2(unit(2, 8));
    Prism out;
    out.center = {unit(-60, 60), unit(-60, 60)};
    out.octagon = {extent / 10.0, extent / 10.0 * unit(1.0, 2.0)};
    out.low = unit(-50, 300);
    out.high = out.low + unit(0, 200);
    return out;
  }
  glm::dvec2 pointIn(const Octagon& o) {
    for (;;) {
      const glm::dvec2 p(unit(-o.extent, o.extent), unit(-o.extent, o.extent));
      if (std::abs(p.x) + std::abs(p.y) <= o.sum) return p;
    }
  }
};

const glm::dvec2 kCell{10.0, 10.05};

glm::dvec3 localOf(glm::dvec2 cell, double height) {
  return {cell.x * kCell.x, -cell.y * kCell.y, height};
}

TEST(ScreenMetric, BoundsTheErrorOfEveryVisiblePointCornersIncluded) {
  int tested = 0;
  double tightest = 0.0;
  for (uint32_t seed = 0; seed < 3000; ++seed) {
    Scene scene(seed);
    const Camera camera = scene.camera();
    const Prism prism = scene.prism();
    const double error = (prism.high - prism.low) * scene.unit(0.01, 1.0);
    const ScreenMetric metric(camera, kCell, 1.0, 0.1);
    const double bound = metric.errorPixels(prism, error);
    for (int i = 0; i < 200; ++i) {
      const glm::dvec2 cell = prism.center + scene.pointIn(prism.octagon);
      const double height = scene.unit(prism.low, prism.high);
      const double other = std::clamp(height + scene.unit(-error, error), prism.low, prism.high);
      const glm::dvec3 a = localOf(cell, height), b = localOf(cell, other);
      if (camera.viewFromLocal(a).z <= 0.1 || camera.viewFromLocal(b).z <= 0.1) continue;
      const glm::dvec2 pixel = camera.pixelFromLocal(a), moved = camera.pixelFromLocal(b);
      if (pixel.x < 0 || pixel.y < 0 || pixel.x > camera.width || pixel.y > camera.height) continue;
      EXPECT_TRUE(metric.visible(prism));
      // The claim is for errors up to the tolerance, beyond which the other point may be far outside.
      const double shift = glm::length(pixel - moved);
      const double claimed = std::max(bound, 0.0);
      if (claimed <= 1.0) {
        EXPECT_LE(shift, claimed * (1 + 1e-9) + 1e-9) << "seed " << seed;
        ++tested;
        if (claimed > 0) tightest = std::max(tightest, shift / claimed);
      } else {
        EXPECT_LE(std::min(shift, 1.0), claimed);
      }
    }
  }
  EXPECT_GT(tested, 1000);
  EXPECT_GT(tightest, 0.5) << "the bound is far from tight";
}

TEST(ScreenMetric, ShrinksWithThePrismAndTheError) {
  for (uint32_t seed = 0; seed < 3000; ++seed) {
    Scene scene(10000 + seed);
    const Camera camera = scene.camera();
    const ScreenMetric metric(camera, kCell, 1.0, 0.1);
    const Prism outer = scene.prism();
    Prism inner = outer;
    inner.octagon.extent *= 0.4;
    inner.octagon.sum *= 0.4;
    inner.center += scene.pointIn({outer.octagon.extent * 0.6, outer.octagon.sum * 0.6});
    inner.low += 0.3 * (outer.high - outer.low);
    inner.high -= 0.3 * (outer.high - outer.low);
    const double error = scene.unit(0.1, 30);
    const double slack = 1 + 1e-9;
    EXPECT_LE(metric.errorPixels(inner, error), metric.errorPixels(outer, error) * slack);
    EXPECT_LE(metric.errorPixels(inner, 0.9 * error), metric.errorPixels(inner, error));
    EXPECT_LE(metric.lengthPixels(inner, error), metric.lengthPixels(outer, error) * slack);
    EXPECT_GE(metric.distance(inner) * slack, metric.distance(outer));
    if (metric.visible(inner)) {
      EXPECT_TRUE(metric.visible(outer));
    }
  }
}

TEST(ScreenMetric, CountsThePixelsOfAPrism) {
  int seen = 0;
  for (uint32_t seed = 0; seed < 300; ++seed) {
    Scene scene(20000 + seed);
    const Camera camera = scene.camera();
    const Prism prism = scene.prism();
    const ScreenMetric metric(camera, kCell, 1.0, 0.1);
    // Rays through every eighth pixel against the prism as an intersection of half-spaces.
    int hits = 0;
    for (int y = 4; y < camera.height; y += 8) {
      for (int x = 4; x < camera.width; x += 8) {
        const glm::dvec3 ray = camera.rayThroughPixel({x + 0.5, y + 0.5});
        double from = 0.1, to = 1e9;
        const auto clip = [&](double atEye, double slope) {  // inside where atEye + t * slope <= 0
          if (slope > 0) to = std::min(to, -atEye / slope);
          if (slope < 0) from = std::max(from, -atEye / slope);
          if (slope == 0 && atEye > 0) to = -1;
        };
        clip(camera.eyeLocal.z - prism.high, ray.z);
        clip(prism.low - camera.eyeLocal.z, -ray.z);
        const glm::dvec2 p{camera.eyeLocal.x / kCell.x - prism.center.x,
                           -camera.eyeLocal.y / kCell.y - prism.center.y};
        const glm::dvec2 v{ray.x / kCell.x, -ray.y / kCell.y};
        for (const double sx : {-1.0, 1.0}) {
          clip(sx * p.x - prism.octagon.extent, sx * v.x);
          clip(sx * p.y - prism.octagon.extent, sx * v.y);
          for (const double sy : {-1.0, 1.0})
            clip(sx * p.x + sy * p.y - prism.octagon.sum, sx * v.x + sy * v.y);
        }
        if (from <= to) ++hits;
      }
    }
    if (hits > 0) ++seen;
    const double area = metric.areaPixels(prism);
    // Off by the sampling along the outline.
    EXPECT_NEAR(area, hits * 64.0, 64.0 + 12.0 * std::sqrt(area) + 0.02 * area) << "seed " << seed;
  }
  EXPECT_GT(seen, 50);
}

TEST(ScreenMetric, IsInfiniteAroundTheCamera) {
  const Camera camera = lookAt({0, 0, 50}, {0, 100, 50}, 1.0, 640, 360);
  const ScreenMetric metric(camera, kCell, 1.0, 0.1);
  EXPECT_TRUE(std::isinf(metric.errorPixels({{0, 0}, {5, 7}, 0, 100}, 0.1)));
  EXPECT_EQ(metric.errorPixels({{0, 0}, {5, 7}, 0, 100}, 0.0), 0.0);
  // Behind the camera.
  EXPECT_EQ(metric.errorPixels({{0, 100}, {5, 7}, 0, 100}, 5.0), 0.0);
}

}  // namespace
}  // namespace terrane
