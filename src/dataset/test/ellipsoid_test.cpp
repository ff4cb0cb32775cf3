#include "terrane/dataset/ellipsoid.h"

#include <gtest/gtest.h>

#include <string>

namespace terrane {
namespace {

TEST(Ellipsoid, IsWhatTheCrsSays) {
  const Ellipsoid bessel = ellipsoidOf(
      R"(PROJCRS["DHDN / 3-degree Gauss-Kruger zone 3",BASEGEOGCRS["DHDN",DATUM["Deutsches ""Haupt""dreiecksnetz",)"
      R"(ELLIPSOID["Bessel 1841",6377397.155,299.1528128,LENGTHUNIT["metre",1]]]]])");
  EXPECT_EQ(bessel.semiMajorMeters, 6377397.155);
  EXPECT_EQ(bessel.flattening, 1.0 / 299.1528128);
  // WKT 1; spaces, lines and round brackets; a name with quotes; a sphere.
  const Ellipsoid moon = ellipsoidOf(
      "PROJCS[\"Moon\",GEOGCS[\"x\",DATUM[\"y\",SPHEROID (\"the \"\"Moon\"\"\",\n 1737400 , 0 )]]]");
  EXPECT_EQ(moon.semiMajorMeters, 1737400.0);
  EXPECT_EQ(moon.flattening, 0.0);
  EXPECT_FALSE(moon.isEarth());
  EXPECT_TRUE(bessel.isEarth());
  EXPECT_EQ(moon.meanRadiusMeters(), 1737400.0);
  // In feet, as Clarke's of 1880 is where it follows Benoit.
  const Ellipsoid feet = ellipsoidOf(
      R"(ELLIPSOID["Clarke 1858",20926348,294.260676369,LENGTHUNIT["Clarke's foot",0.3047972654]])");
  EXPECT_NEAR(feet.semiMajorMeters, 6378293.645, 0.001);
}

TEST(Ellipsoid, IsTheEarthsWhereNothingSensibleIsSaid) {
  EXPECT_NEAR(Ellipsoid{}.meanRadiusMeters(), 6371008.8, 0.1);
  for (const char* text :
       {"", "ELLIPSOID", "ELLIPSOID[", "ELLIPSOID[\"a", "ELLIPSOID[\"a\",", "ELLIPSOID[\"a\",1e400,0]",
        "ELLIPSOID[\"a\",nan,0]", "ELLIPSOID[\"a\",-5000000,0]", "ELLIPSOID[\"a\",6378137",
        "ELLIPSOID[\"a\",6378137,", "ELLIPSOID[\"a\",6378137,0.5]", "ELLIPSOID[a,6378137,298]",
        "LOCAL_CS[\"SPHEROID of somebody\"]"})
    EXPECT_EQ(ellipsoidOf(text).semiMajorMeters, 6378137.0) << text;
  // A word in a name is not the ellipsoid.
  EXPECT_EQ(
      ellipsoidOf(R"(PROJCRS["On an ELLIPSOID",BASEGEOGCRS["x",DATUM["y",ELLIPSOID["z",3396190,169.8]]]])")
          .semiMajorMeters,
      3396190.0);
}

}  // namespace
}  // namespace terrane
