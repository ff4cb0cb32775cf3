#include "terrane/tiling/camera.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <random>

#include "terrane/tiling/frame.h"

namespace terrane {
namespace {

TEST(Camera, RaysAndPixelsAreInverse) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 eye(unit(random) * 1e6, unit(random) * 1e6, unit(random) * 1e4);
    const glm::dvec3 target = eye + glm::dvec3(unit(random), unit(random), unit(random));
    const Camera camera = lookAt(eye, target, 0.2 + 1.3 * std::abs(unit(random)), 640, 360);
    const glm::dvec2 pixel(320.0 + 320.0 * unit(random), 180.0 + 180.0 * unit(random));
    const glm::dvec3 point = eye + 1234.5 * camera.rayThroughPixel(pixel);
    EXPECT_NEAR(glm::length(camera.pixelFromLocal(point) - pixel), 0.0, 1e-6);
    EXPECT_NEAR(camera.viewFromLocal(point).z, 1234.5, 1e-6);
    EXPECT_NEAR(glm::length(camera.right), 1.0, 1e-12);
    EXPECT_NEAR(camera.right.z, 0.0, 1e-12);
  }
}

TEST(Camera, LooksStraightDownWithNorthOnTop) {
  const Camera camera = lookAt({10, 20, 500}, {10, 20, 0}, 1.0, 100, 100);
  EXPECT_NEAR(camera.up.y, 1.0, 1e-9);
  EXPECT_LT(camera.pixelFromLocal({10, 30, 0}).y, 50.0);
  EXPECT_GT(camera.pixelFromLocal({20, 20, 0}).x, 50.0);
}

TEST(Frame, ConvertsBothWays) {
  const Frame frame{.originEasting = 500000,
                    .originNorthing = 4200000,
                    .spacingX = 30,
                    .spacingY = 30.1,
                    .metersPerUnit = 0.3048,
                    .finestLevel = 3};
  const glm::dvec3 crs(501234.5, 4198765.25, 812.0);
  const glm::dvec3 back = frame.crsFromLocal(frame.localFromCrs(crs));
  EXPECT_NEAR(back.x, crs.x, 1e-6);
  EXPECT_NEAR(back.y, crs.y, 1e-6);
  EXPECT_EQ(back.z, crs.z);
  EXPECT_LT(frame.localFromSample({0, 10}).y, 0.0);
  EXPECT_NEAR(frame.sampleFromLocal(frame.localFromSample({3.5, 4.25})).y, 4.25, 1e-12);
}

}  // namespace
}  // namespace terrane
