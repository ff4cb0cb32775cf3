#include "terrane/reference/measure_picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace terrane {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Rolling ground of 1280 m a side, with ridges that hide what is behind them.
ReferenceGrid rollingGrid() {
  ReferenceGrid grid;
  grid.cols = grid.rows = 129;
  grid.spacingX = grid.spacingY = 10.0;
  for (int64_t j = 0; j < grid.rows; ++j) {
    for (int64_t i = 0; i < grid.cols; ++i) {
      grid.heights.push_back(static_cast<float>(40.0 * std::sin(0.1 * static_cast<double>(i)) *
                                                std::cos(0.13 * static_cast<double>(j))));
    }
  }
  grid.groundCells.assign(static_cast<size_t>(((grid.cols - 1) * (grid.rows - 1) + 7) / 8), 0xff);
  return grid;
}

/// What a perfect renderer of `surface` shows, moved up by `lift` metres.
std::vector<glm::dvec3> draw(const ReferenceSurface& surface, Camera camera, double lift) {
  std::vector<glm::dvec3> places;
  camera.eyeLocal.z -= lift;
  for (int row = 0; row < camera.height; ++row) {
    for (int col = 0; col < camera.width; ++col) {
      const auto hit = surface.cast(camera.eyeLocal, camera.rayThroughPixel({col + 0.5, row + 0.5}));
      places.push_back(hit ? hit->point + glm::dvec3(0, 0, lift) : glm::dvec3(kNaN));
    }
  }
  return places;
}

TEST(MeasurePicture, APerfectPictureHasNoFaults) {
  const ReferenceSurface surface(rollingGrid());
  const Camera camera = lookAt({640, -1250, 90}, {640, -600, 0}, 0.8, 160, 90);
  const auto places = draw(surface, camera, 0.0);
  const ErrorMeasure error = measureError(surface, camera, places, 1.0);
  EXPECT_GT(error.pixels, 5000);
  EXPECT_LT(error.maxPixels, 1e-9);
  EXPECT_EQ(error.aboveTau, 0);
  const CrackMeasure cracks = measureCracks(surface, camera, places, 1.0);
  EXPECT_GT(cracks.skyPixels, 1000);
  EXPECT_EQ(cracks.cracks, 0);
  EXPECT_EQ(cracks.seeThrough, 0);
  EXPECT_EQ(cracks.checked + cracks.skyPixels, 160 * 90);
}

TEST(MeasurePicture, MeasuresAKnownError) {
  // Level ground seen from straight ahead at depth 100 m: a lift of 0.5 m is as many pixels.
  ReferenceGrid grid = rollingGrid();
  std::fill(grid.heights.begin(), grid.heights.end(), 0.0F);
  const ReferenceSurface surface(std::move(grid));
  const Camera camera = lookAt({640, -700, 5}, {640, -600, 5}, 0.8, 161, 91);
  std::vector<glm::dvec3> places(161 * 91, glm::dvec3(kNaN));
  places[45 * 161 + 80] = {640, -600, 0.5};
  const ErrorMeasure error = measureError(surface, camera, places, 0.1);
  EXPECT_EQ(error.pixels, 1);
  EXPECT_NEAR(error.maxPixels, 0.5 * camera.pixelsPerTangent() / 100.0, 1e-9);
  EXPECT_NEAR(error.rms(), error.maxPixels, 1e-12);
  EXPECT_NEAR(error.percentile999(), error.maxPixels, 0.01);
  EXPECT_EQ(error.aboveTau, 1);
  EXPECT_EQ(error.maxAt, glm::ivec2(80, 45));
}

TEST(MeasurePicture, ForgivesOutlinesThatMoveByTau) {
  const ReferenceSurface surface(rollingGrid());
  const Camera camera = lookAt({640, -1250, 90}, {640, -600, 0}, 0.8, 160, 90);
  // 0.3 m at 100 m and beyond is less than a pixel here.
  for (const double lift : {-0.3, 0.3}) {
    const auto places = draw(surface, camera, lift);
    EXPECT_LT(measureError(surface, camera, places, 1.0).maxPixels, 1.0);
    const CrackMeasure cracks = measureCracks(surface, camera, places, 1.0);
    EXPECT_EQ(cracks.cracks, 0);
    EXPECT_EQ(cracks.seeThrough, 0);
  }
}

TEST(MeasurePicture, CountsEveryCrack) {
  const ReferenceSurface surface(rollingGrid());
  const Camera camera = lookAt({640, -1250, 90}, {640, -600, 0}, 0.8, 160, 90);
  auto places = draw(surface, camera, 0.0);
  // A crack one pixel wide down the middle of the ground; outlines are forgiven within two pixels.
  int64_t cut = 0;
  for (int row = 0; row < 90; ++row) {
    glm::dvec3& place = places[static_cast<size_t>(row * 160 + 80)];
    if (!std::isnan(place.z)) ++cut;
    place = glm::dvec3(kNaN);
  }
  const CrackMeasure cracks = measureCracks(surface, camera, places, 1.0);
  EXPECT_LE(cracks.cracks, cut);
  EXPECT_GE(cracks.cracks, cut - 4);
  EXPECT_FALSE(cracks.where.empty());
}

TEST(MeasurePicture, SeesThroughHolesInNearGround) {
  const ReferenceSurface surface(rollingGrid());
  const Camera camera = lookAt({640, -1250, 60}, {640, -600, 0}, 0.8, 160, 90);
  auto places = draw(surface, camera, 0.0);
  // A pixel of near ground shows ground behind it that nothing but a hole lets see.
  glm::dvec3& place = places[60 * 160 + 80];
  ASSERT_FALSE(std::isnan(place.z));
  const glm::dvec3 ray = camera.rayThroughPixel({80.5, 60.5});
  double depth = camera.viewFromLocal(place).z;
  const auto isHidden = [&](glm::dvec3 point) {
    const auto hit = surface.cast(camera.eyeLocal, point - camera.eyeLocal);
    return hit && hit->distance < 0.99;
  };
  do {
    depth += 5.0;
    place = camera.eyeLocal + depth * ray;
    const auto height = surface.heightAt({place.x, place.y});
    ASSERT_TRUE(height.has_value());
    place.z = *height;
  } while (!isHidden(place));
  EXPECT_EQ(measureCracks(surface, camera, places, 1.0).seeThrough, 1);
}

TEST(MeasurePicture, CountsCracksWhateverHasLoaded) {
  const ReferenceSurface surface(rollingGrid());
  const ReferenceSurface::Cover cover(surface, 8);
  const Camera camera = lookAt({640, -900, 400}, {640, -640, 0}, 0.8, 160, 90);
  // Flat ground stands for the coarsest level.
  std::vector<glm::dvec3> places;
  for (int row = 0; row < 90; ++row) {
    for (int col = 0; col < 160; ++col) {
      const glm::dvec3 ray = camera.rayThroughPixel({col + 0.5, row + 0.5});
      places.push_back(camera.eyeLocal - camera.eyeLocal.z / ray.z * ray);
    }
  }
  CrackMeasure cracks = measureCracksWhileLoading(cover, camera, places);
  EXPECT_GT(cracks.checked, 5000);
  EXPECT_EQ(cracks.cracks, 0);
  places[45 * 160 + 80] = glm::dvec3(kNaN);
  cracks = measureCracksWhileLoading(cover, camera, places);
  EXPECT_EQ(cracks.cracks, 1);
}

TEST(ErrorMeasure, AddsUp) {
  ErrorMeasure a;
  ErrorMeasure b;
  a.pixels = 999;
  a.histogram.assign(1001, 0);
  a.histogram[10] = 999;
  a.maxPixels = 0.105;
  b.pixels = 2;
  b.histogram.assign(1001, 0);
  b.histogram[500] = 2;
  b.maxPixels = 5.001;
  b.aboveTau = 2;
  a.add(b);
  EXPECT_EQ(a.pixels, 1001);
  EXPECT_EQ(a.maxPixels, 5.001);
  EXPECT_NEAR(a.percentile999(), 5.001, 0.01);
  EXPECT_NEAR(a.fractionAboveTau(), 2.0 / 1001.0, 1e-12);
}

}  // namespace
}  // namespace terrane
