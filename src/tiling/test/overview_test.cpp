#include "terrane/tiling/overview.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <random>

namespace terrane {
namespace {

TEST(Overview, ShowsTheWholeGroundAndLittleElse) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 500; ++i) {
    const GroundBox box{
        {1000.0, -9000.0, -50.0},
        {1000.0 + 100.0 + 8000.0 * unit(random), -8900.0 + 8000.0 * unit(random), 2000.0 * unit(random)}};
    const Camera camera =
        overviewCamera(box, 360.0 * unit(random), 5.0 + 85.0 * unit(random), 0.3 + unit(random), 640, 360);
    double largest = 0.0;
    glm::dvec2 low(1e300), high(-1e300);
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 p((corner & 1) ? box.high.x : box.low.x, (corner & 2) ? box.high.y : box.low.y,
                         (corner & 4) ? box.high.z : box.low.z);
      ASSERT_GT(camera.viewFromLocal(p).z, 0.0);
      const glm::dvec2 pixel = camera.pixelFromLocal(p);
      low = glm::min(low, pixel);
      high = glm::max(high, pixel);
      largest = std::max({largest, std::abs(pixel.x / 320.0 - 1.0), std::abs(pixel.y / 180.0 - 1.0)});
    }
    EXPECT_LE(largest, 1.0);
    EXPECT_GE(largest, 0.8);
    // As much room on the left as on the right, above as below.
    EXPECT_NEAR(low.x, 640.0 - high.x, 1e-3);
    EXPECT_NEAR(low.y, 360.0 - high.y, 1e-3);
  }
}

}  // namespace
}  // namespace terrane
