#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "web_mercator.h"
#include "xyz_places.h"
#include "xyz_tiles.h"

namespace terrane::serve {
namespace {

TEST(WebMercator, IsItsOwnInverse) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(0.0, 1.0);
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec2 p(place(random), place(random));
    const glm::dvec2 back = mercatorFromDegrees(degreesFromMercator(p));
    EXPECT_NEAR(back.x, p.x, 1e-14);
    EXPECT_NEAR(back.y, p.y, 1e-14);
  }
  EXPECT_NEAR(degreesFromMercator({0.0, 0.0}).y, kMercatorLatitude, 1e-9);
  EXPECT_EQ(degreesFromMercator({0.5, 0.5}), glm::dvec2(0.0, 0.0));
  // Zurich's tile, as every web map has it.
  const glm::dvec2 zurich = mercatorFromDegrees({8.54, 47.37}) * std::ldexp(1.0, 12);
  EXPECT_EQ(glm::ivec2(zurich), glm::ivec2(2145, 1434));
}

TEST(WebMercator, ReadsAddressesAndNothingElse) {
  const auto address = readXyz("12", "4095", "0");
  ASSERT_TRUE(address);
  EXPECT_EQ(address->z, 12);
  EXPECT_EQ(address->x, 4095);
  EXPECT_TRUE(readXyz("0", "0", "0"));
  EXPECT_TRUE(readXyz("24", "16777215", "16777215"));
  for (const auto& [z, x, y] :
       {std::tuple{"12", "4096", "0"}, std::tuple{"12", "0", "4096"}, std::tuple{"0", "1", "0"},
        std::tuple{"25", "0", "0"}, std::tuple{"-1", "0", "0"}, std::tuple{"1", "-0", "0"},
        std::tuple{"1", "0", ""}, std::tuple{"1", "0x", "0"}, std::tuple{"1", "0", "+1"},
        std::tuple{"1", "99999999999", "0"}})
    EXPECT_FALSE(readXyz(z, x, y)) << z << "/" << x << "/" << y;
}

/// A dataset's lattice in some CRS.
struct Ground {
  const char* crs;
  Frame frame;
  double side;  ///< samples
};
Manifest manifestOf(const Ground& ground) {
  Manifest out;
  out.crsWkt = ground.crs;
  out.frame = ground.frame;
  out.extentCols = out.extentRows = static_cast<int64_t>(ground.side);
  return out;
}

TEST(XyzPlaces, AreWhereProjHasThem) {
  const Ground grounds[] = {
      {"EPSG:32632", {399000.0, 5210000.0, 25.0, 25.0, 1.0, 4}, 4097},
      {"EPSG:3857", {900000.0, 6000000.0, 30.0, 30.0, 1.0, 4}, 4097},
      {"EPSG:2154", {100000.0, 7100000.0, 250.0, 250.0, 1.0, 4}, 4097},      // all of France
      {"EPSG:3413", {-2400000.0, 0.0, 1000.0, 1000.0, 1.0, 4}, 4097},        // Greenland, from the pole on
      {"EPSG:3995", {-2000000.0, 2000000.0, 1000.0, 1000.0, 1.0, 4}, 4097},  // around the pole
      {"EPSG:3832", {2800000.0, -1000000.0, 500.0, 500.0, 1.0, 4}, 4097},  // Fiji, across the 180th meridian
      {"EPSG:2226", {6600000.0, 2100000.0, 30.0, 30.0, 0.3048006096012192, 4}, 4097},  // feet
  };
  std::mt19937 random(2);
  for (const Ground& ground : grounds) {
    Geographic geographic(ground.crs);
    const Manifest manifest = manifestOf(ground);
    const auto extent = xyzExtentOf(manifest, geographic);
    ASSERT_TRUE(extent) << ground.crs;
    int checked = 0;
    for (int z = 0; z <= extent->zoomFor(1); ++z) {
      // A tile at a place of the data, and all its pixels against PROJ.
      std::uniform_real_distribution<double> share(0.02, 0.98);
      const glm::dvec2 sample = glm::dvec2(share(random), share(random)) * ground.side;
      const glm::dvec2 crs(ground.frame.crsFromLocal({ground.frame.localFromSample(sample), 0.0}));
      const std::vector<glm::dvec2> crsPlaces = {crs};
      const glm::dvec2 degrees = geographic.geographicFromCrs(std::span<const glm::dvec2>(crsPlaces)).front();
      EXPECT_TRUE(extent->contains(degrees) || degrees.y > kMercatorLatitude)
          << ground.crs << " " << degrees.x;
      if (degrees.y > kMercatorLatitude) continue;
      const glm::dvec2 place = mercatorFromDegrees(degrees) * std::ldexp(1.0, z);
      const XyzAddress tile{z, static_cast<int>(place.x), static_cast<int>(place.y)};
      EXPECT_TRUE(extent->meets(tile)) << ground.crs << " " << z;
      const XyzPlaces places = xyzPlacesOf(tile, *extent, ground.frame, geographic);
      for (int i = 0; i < 200; ++i) {
        const size_t at = random() % places.samples.size();
        if (std::isnan(places.samples[at].x)) continue;
        const glm::dvec2 pixel(static_cast<double>(at % 256) + 0.5, static_cast<double>(at / 256) + 0.5);
        const auto samplesOf = [&](glm::dvec2 inTile) {
          const auto exact = geographic.crsFromGeographic(
              degreesFromMercator((glm::dvec2(tile.x, tile.y) + inTile / 256.0) / std::ldexp(1.0, z)));
          return ground.frame.sampleFromLocal(
              glm::dvec2(ground.frame.localFromCrs({exact.value_or(glm::dvec2(NAN)), 0.0})));
        };
        const glm::dvec2 wanted = samplesOf(pixel), east = samplesOf(pixel + glm::dvec2(1.0, 0.0)) - wanted,
                         off = places.samples[at] - wanted;
        EXPECT_LT(std::hypot(off.x, off.y), 0.1 * std::hypot(east.x, east.y)) << ground.crs << " " << z;
        ++checked;
      }
    }
    EXPECT_GT(checked, 500) << ground.crs;
  }
}

TEST(XyzPlaces, TheExtentIsThatOfTheData) {
  {
    Geographic geographic("EPSG:32632");
    const auto extent =
        xyzExtentOf(manifestOf({"EPSG:32632", {399000.0, 5210000.0, 25.0, 25.0, 1.0, 4}, 4097}), geographic);
    ASSERT_TRUE(extent);
    EXPECT_NEAR(extent->west, 7.67, 0.03);
    EXPECT_NEAR(extent->east, 9.03, 0.03);
    EXPECT_NEAR(extent->south, 46.12, 0.03);
    EXPECT_NEAR(extent->north, 47.05, 0.03);
    // A pixel of z is 156543 m / 2^z at the equator, less by the cosine of the latitude here.
    EXPECT_EQ(extent->zoomFor(0), 13);
    EXPECT_EQ(extent->zoomFor(2), 15);
    EXPECT_FALSE(extent->meets({3, 0, 0}));
    EXPECT_TRUE(extent->meets({0, 0, 0}));
  }
  {
    Geographic geographic("EPSG:3832");
    const auto extent = xyzExtentOf(
        manifestOf({"EPSG:3832", {2800000.0, -1000000.0, 500.0, 500.0, 1.0, 4}, 4097}), geographic);
    ASSERT_TRUE(extent);
    EXPECT_GT(extent->west, 170.0);
    EXPECT_LT(extent->east, -160.0);
    EXPECT_TRUE(extent->contains({179.0, -15.0}));
    EXPECT_TRUE(extent->contains({-179.0, -15.0}));
    EXPECT_FALSE(extent->contains({0.0, -15.0}));
  }
  {
    Geographic geographic("EPSG:3995");
    const auto extent = xyzExtentOf(
        manifestOf({"EPSG:3995", {-2000000.0, 2000000.0, 1000.0, 1000.0, 1.0, 4}, 4097}), geographic);
    ASSERT_TRUE(extent);
    EXPECT_EQ(extent->west, -180.0);
    EXPECT_EQ(extent->east, 180.0);
    EXPECT_DOUBLE_EQ(extent->north, kMercatorLatitude);
  }
  // The Moon is not on the map of the earth.
  Geographic moon("+proj=eqc +R=1737400 +units=m +type=crs");
  const Ground onMoon{"", {0.0, 0.0, 118.0, 118.0, 1.0, 4}, 4097};
  EXPECT_FALSE(xyzExtentOf(manifestOf(onMoon), moon));
}

TEST(XyzTiles, HeightsComeBackFromTheirColors) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> height(-9000.0, 9000.0);
  for (int i = 0; i < 10000; ++i) {
    const double meters = height(random);
    const HeightColor rgb = colorOfHeight(meters, HeightColors::TerrainRgb, 1);
    EXPECT_NEAR(-10000.0 + 0.1 * (rgb.red * 65536 + rgb.green * 256 + rgb.blue), meters, 0.0501);
    for (const int step : {1, 8, 256}) {
      const HeightColor terrarium = colorOfHeight(meters, HeightColors::Terrarium, step);
      EXPECT_NEAR(terrarium.red * 256.0 + terrarium.green + terrarium.blue / 256.0 - 32768.0, meters,
                  0.5001 * step / 256.0);
    }
  }
  // What does not fit becomes the nearest.
  EXPECT_EQ(colorOfHeight(1e9, HeightColors::Terrarium, 1).red, 255);
  EXPECT_EQ(colorOfHeight(-1e9, HeightColors::TerrainRgb, 1).blue, 0);
  EXPECT_EQ(terrariumStep(0.5, 0.0), 1);
  EXPECT_EQ(terrariumStep(30.0, 0.0), 4);
  EXPECT_EQ(terrariumStep(1.0, 1.0), 64);
  EXPECT_EQ(terrariumStep(1e6, 0.0), 256);
}

}  // namespace
}  // namespace terrane::serve
