#include "geographic.h"

#include <gtest/gtest.h>

#include <cmath>

namespace terrane::serve {
namespace {

double lengthIn(const char* crs, const std::vector<glm::dvec2>& line) {
  const auto along = Geographic(crs).metersAlong(line);
  return along ? along->back() : NAN;
}

TEST(Geographic, LengthsAreThoseOnTheEllipsoid) {
  // Web Mercator at 60 degrees: a parallel's radius is what it is, its equator's length is drawn.
  Geographic mercator("EPSG:3857");
  const auto north = mercator.crsFromGeographic({7.0, 60.0});
  ASSERT_TRUE(north);
  const double sine = std::sin(60.0 * M_PI / 180.0);
  const double parallel = 0.5 / std::sqrt(1.0 - 0.00669437999014 * sine * sine);
  const auto along =
      mercator.metersAlong(std::vector<glm::dvec2>{*north, *north + glm::dvec2(1000.0, 0.0), *north});
  ASSERT_TRUE(along);
  ASSERT_EQ(along->size(), 3U);
  EXPECT_EQ((*along)[0], 0.0);
  EXPECT_NEAR((*along)[1], 1000.0 * parallel, 1e-3);
  EXPECT_NEAR((*along)[2], 2000.0 * parallel, 1e-3);
  // A parallel is straight there, and 900 km long: longer than the shortest way. A part in a million is left
  // to the parts.
  EXPECT_NEAR(lengthIn("EPSG:3857", {*north, *north + glm::dvec2(900e3, 0.0)}), 900e3 * parallel, 1.0);
  EXPECT_NEAR(lengthIn("EPSG:32632", {{500000.0, 6700000.0}, {500100.0, 6700000.0}}), 100.0 / 0.9996, 1e-4);
  // With heights of its own; in feet.
  EXPECT_NEAR(lengthIn("EPSG:25832+7837", {{500000.0, 6700000.0}, {500100.0, 6700000.0}}), 100.0 / 0.9996,
              1e-4);
  EXPECT_NEAR(lengthIn("EPSG:2229", {{6.5e6, 1.8e6}, {6.5e6 + 1000.0, 1.8e6}}), 304.8, 0.05);
}

TEST(Geographic, DatumsAreRelatedAsABuildWarps) {
  // NAD83 and WGS 84 are taken for the same, as GDAL does where it has no grids, not for a metre apart.
  const auto nad = Geographic("EPSG:26910").crsFromGeographic({-121.72, 45.37});
  const auto wgs = Geographic("EPSG:32610").crsFromGeographic({-121.72, 45.37});
  ASSERT_TRUE(nad && wgs);
  EXPECT_NEAR(nad->x, wgs->x, 0.01);
  EXPECT_NEAR(nad->y, wgs->y, 0.01);
}

TEST(Geographic, LengthsAreKnownOnOtherBodies) {
  const char* moon = "+proj=merc +R=1737400 +units=m +no_defs +type=crs";
  const double north = 1737400.0 * std::log(std::tan(75.0 * M_PI / 180.0));  // 60 degrees
  EXPECT_NEAR(lengthIn(moon, {{0.0, north}, {1000.0, north}}), 500.0, 1e-3);
}

TEST(Geographic, WhatIsNotKnownIsNotSaid) {
  EXPECT_FALSE(Geographic("").metersAlong(std::vector<glm::dvec2>{{0.0, 0.0}, {1.0, 1.0}}));
  EXPECT_FALSE(Geographic("LOCAL_CS[\"somewhere\",UNIT[\"metre\",1]]")
                   .metersAlong(std::vector<glm::dvec2>{{0.0, 0.0}, {1.0, 1.0}}));
  // Counts in grads.
  EXPECT_FALSE(Geographic("EPSG:27572")
                   .metersAlong(std::vector<glm::dvec2>{{600000.0, 2200000.0}, {600100.0, 2200000.0}}));
  EXPECT_FALSE(Geographic("EPSG:32632").metersAlong(std::vector<glm::dvec2>{{NAN, 0.0}, {1.0, 1.0}}));
}

}  // namespace
}  // namespace terrane::serve
