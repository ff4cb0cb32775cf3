#include <gtest/gtest.h>

#include "source_support.h"

namespace terrane {
namespace {

using test::from;
using test::open;
using test::openError;
using test::TempFolder;
using test::writeRaster;

// A degree-sized raster whose north-west corner is there.
void writeDegrees(const std::string& path, double west, double north, const std::string& crs = "EPSG:4326") {
  writeRaster(path, {.crs = crs, .geoTransform = {west, 0.01, 0.0, north, 0.0, -0.01}});
}

TEST(SourceCrs, TakesTheBestUtmZone) {
  TempFolder folder;
  const struct {
    double west, north;
    const char* name;
  } cases[] = {{8.0, 47.0, "WGS 84 / UTM zone 32N"},     {-120.6, 38.0, "WGS 84 / UTM zone 10N"},
               {-119.9, 38.0, "WGS 84 / UTM zone 11N"},  {20.1, -33.7, "WGS 84 / UTM zone 34S"},
               {179.7, -17.0, "WGS 84 / UTM zone 60S"},  {-180.0, 60.0, "WGS 84 / UTM zone 1N"},
               {10.0, 86.0, "WGS 84 / UPS North (N,E)"}, {10.0, -82.0, "WGS 84 / UPS South (N,E)"}};
  for (const auto& one : cases) {
    writeDegrees(folder / "a.tif", one.west, one.north);
    const auto source = open(from({folder / "a.tif"}));
    ASSERT_TRUE(source);
    EXPECT_EQ(source->plan().crsName, one.name);
    EXPECT_TRUE(source->plan().inputs[0].warped);
    EXPECT_TRUE(test::read(*source, {source->plan().frame.finestLevel, 0, 0}).any);
  }
}

TEST(SourceCrs, StaysTogetherOverTheDateLine) {
  TempFolder folder;
  writeDegrees(folder / "a.tif", 179.5, -17.0);
  writeDegrees(folder / "b.tif", -179.9, -17.0);
  const auto source = open(from({folder / "a.tif", folder / "b.tif"}));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->plan().crsName, "WGS 84 / UTM zone 1S");
  EXPECT_LT(source->plan().extentCols, 200);
}

TEST(SourceCrs, KeepsTheInputsDatum) {
  TempFolder folder;
  writeDegrees(folder / "a.tif", -120.6, 38.0, "EPSG:4269");
  const auto source = open(from({folder / "a.tif"}));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->plan().crsName, "NAD83 / UTM zone 10N");
}

TEST(SourceCrs, MixedInputsMeetInOneZone) {
  TempFolder folder;
  writeDegrees(folder / "a.tif", 8.0, 46.0);
  writeRaster(folder / "b.tif", {.width = 200,
                                 .height = 200,
                                 .crs = "EPSG:32633",
                                 .geoTransform = {0.0, 800.0, 0.0, 5100000.0, 0.0, -800.0}});
  const auto source = open(from({folder / "a.tif", folder / "b.tif"}));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->plan().crsName, "WGS 84 / UTM zone 32N");
  EXPECT_TRUE(source->plan().inputs[0].warped);
  EXPECT_TRUE(source->plan().inputs[1].warped);
}

TEST(SourceCrs, TakesOtherBodies) {
  TempFolder folder;
  const std::string moon = "+proj=longlat +R=1737400 +no_defs";
  writeDegrees(folder / "a.tif", 59.0, 17.0, moon);
  const auto geographic = open(from({folder / "a.tif"}));
  ASSERT_TRUE(geographic);
  EXPECT_HAS(geographic->plan().crsName, "Transverse Mercator 59");
  EXPECT_NEAR(geographic->plan().frame.spacingX, 0.01 * 1737400 * 3.14159265 / 180, 12.0);
  writeRaster(folder / "b.tif", {.crs = "+proj=eqc +R=1737400 +units=m +no_defs"});
  const auto projected = open(from({folder / "b.tif"}));
  ASSERT_TRUE(projected);
  EXPECT_FALSE(projected->plan().inputs[0].warped);
  EXPECT_HAS(projected->plan().crsName, "1737400");
  EXPECT_HAS(openError(from({folder / "b.tif", "/dev/null"})), "/dev/null");
}

TEST(SourceCrs, MeasuresFeetOfTheCrs) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.crs = "EPSG:2226"});
  const auto source = open(from({folder / "a.tif"}));
  ASSERT_TRUE(source);
  EXPECT_NEAR(source->plan().frame.metersPerUnit, 0.3048006, 1e-7);
  EXPECT_EQ(source->plan().frame.spacingX, 10.0);
  EXPECT_NEAR(source->plan().maxErrorMeters, 10.0 * 0.3048006 / 200, 1e-6);
  EXPECT_FALSE(source->plan().inputs[0].warped);
}

TEST(SourceCrs, TakesTheUsersWord) {
  TempFolder folder;
  writeRaster(folder / "none.tif", {.crs = ""});
  const std::string error = openError(from({folder / "none.tif"}));
  EXPECT_HAS(error, "none.tif: has no CRS");
  EXPECT_HAS(error, "--source-crs");
  auto options = from({folder / "none.tif"});
  options.sourceCrs = "EPSG:32631";
  const auto source = open(options);
  ASSERT_TRUE(source);
  EXPECT_EQ(source->plan().crsName, "WGS 84 / UTM zone 31N");
  EXPECT_HAS(source->plan().inputs[0].sourceCrs, "UTM zone 31N");

  options.crs = "EPSG:4326";
  EXPECT_HAS(openError(options), "needs a projected CRS");
  options.crs = "EPSG:123456789";
  EXPECT_HAS(openError(options), "not a CRS that PROJ knows");
  options.crs.clear();
  options.sourceCrs = "nonsense";
  EXPECT_HAS(openError(options), "--source-crs nonsense");
}

TEST(SourceCrs, WarnsWhereTheMapIsLongerThanTheGround) {
  TempFolder folder;
  const auto warningsOf = [&](const std::string& crs, double west, double north, double spacing) {
    writeRaster(folder / "a.tif", {.crs = crs, .geoTransform = {west, spacing, 0.0, north, 0.0, -spacing}});
    test::ListeningProgress listening;
    EXPECT_TRUE(openSource(from({folder / "a.tif"}), listening).ok());
    return listening.all();
  };
  // Web Mercator at 60 degrees north, twice as long; at the equator; a UTM zone far from its meridian; feet.
  EXPECT_HAS(warningsOf("EPSG:3857", 1e6, 8399737.0, 10.0), "2 times as long");
  EXPECT_EQ(warningsOf("EPSG:3857", 1e6, 0.0, 10.0), "");
  EXPECT_EQ(warningsOf("EPSG:32632", 800000.0, 5.5e6, 10.0), "");
  EXPECT_EQ(warningsOf("EPSG:2263", 980000.0, 200000.0, 30.0), "");
  // Plate carree is true along meridians only.
  EXPECT_HAS(warningsOf("EPSG:32662", 0.0, 6679169.4, 100.0), "0.999 to 1.99 times as long");
}

TEST(SourceCrs, RefusesWhatNoZoneCovers) {
  TempFolder folder;
  writeRaster(
      folder / "world.tif",
      {.width = 360, .height = 160, .crs = "EPSG:4326", .geoTransform = {-180.0, 1.0, 0.0, 80.0, 0.0, -1.0}});
  EXPECT_HAS(openError(from({folder / "world.tif"})), "--crs");
  auto options = from({folder / "world.tif"});
  options.crs = "EPSG:3857";
  EXPECT_TRUE(open(options));
  writeRaster(folder / "west.tif", {.crs = "EPSG:5513"});
  EXPECT_HAS(openError(from({folder / "west.tif"})), "axes point");
}

}  // namespace
}  // namespace terrane
