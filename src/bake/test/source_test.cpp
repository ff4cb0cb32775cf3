#include "terrane/bake/source.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

#include "source_support.h"

namespace terrane {
namespace {

using test::from;
using test::ListeningProgress;
using test::MadeRaster;
using test::open;
using test::openError;
using test::read;
using test::ReadTile;
using test::TempFolder;
using test::tryRead;
using test::writeRaster;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Source, TakesAProjectedRasterSampleBySample) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.width = 300, .height = 20});
  const auto source = open(from({folder / "a.tif"}));
  ASSERT_TRUE(source);
  const SourcePlan& plan = source->plan();
  EXPECT_EQ(plan.crsName, "WGS 84 / UTM zone 32N");
  EXPECT_EQ(plan.frame.originEasting, 500000.0);
  EXPECT_EQ(plan.frame.originNorthing, 5000000.0);
  EXPECT_EQ(plan.frame.spacingX, 10.0);
  EXPECT_EQ(plan.frame.finestLevel, 1);
  EXPECT_EQ(plan.extentCols, 300);
  EXPECT_EQ(plan.extentRows, 20);
  ASSERT_EQ(plan.inputs.size(), 1u);
  EXPECT_FALSE(plan.inputs[0].warped);
  EXPECT_EQ(plan.inputs[0].name, "a.tif");
  EXPECT_EQ(plan.inputs[0].sha256.size(), 64u);
  EXPECT_EQ(source->nativeLevels(), std::vector<int>{1});

  // Both tiles share their border; beyond the raster there is nothing.
  const auto west = read(*source, {1, 0, 0});
  const auto east = read(*source, {1, 1, 0});
  EXPECT_TRUE(west.any);
  EXPECT_EQ(west.at(0, 0), 100.0F);
  EXPECT_EQ(west.at(256, 19), 100.0F + 256 + 950);
  EXPECT_EQ(east.at(0, 19), west.at(256, 19));
  EXPECT_EQ(east.at(43, 0), 399.0F);
  EXPECT_EQ(east.rankAt(43, 0), 1);
  EXPECT_TRUE(east.voidAt(44, 0));
  EXPECT_TRUE(west.voidAt(0, 20));
  EXPECT_TRUE(source->mayTouch({1, 1, 0}));
  EXPECT_FALSE(source->mayTouch({1, 0, 1}));
  EXPECT_FALSE(read(*source, {1, 0, 1}).any);
}

TEST(Source, TakesASquareOf257SamplesAsOneTile) {
  TempFolder folder;
  writeRaster(folder / "a.tif",
              {.width = 257, .height = 257, .heightAt = [](int c, int r) { return c + r; }});
  const auto source = open(from({folder / "a.tif"}));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->plan().frame.finestLevel, 0);
  EXPECT_EQ(read(*source, {0, 0, 0}).at(256, 256), 512.0F);
}

TEST(Source, HonoursNoDataNaNAndInfinity) {
  TempFolder folder;
  const auto heightAt = [](int col, int) {
    switch (col) {
      case 1:
        return -9999.0;
      case 2:
        return kNaN;
      case 3:
        return kInfinity;
      case 4:
        return -kInfinity;
      case 5:
        return -3.4028234663852886e+38;
      case 6:
        return 7.0;
      default:
        return 10.0;
    }
  };
  writeRaster(folder / "a.tif", {.noData = -9999.0, .heightAt = heightAt});
  const auto source = open(from({folder / "a.tif"}));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->plan().inputs[0].noData, "-9999");
  const auto tile = read(*source, {0, 0, 0});
  for (int col = 1; col <= 5; ++col) EXPECT_TRUE(tile.voidAt(col, 3)) << col;
  EXPECT_EQ(tile.at(6, 3), 7.0F);

  // The user's word replaces the file's.
  auto options = from({folder / "a.tif"});
  options.noData = 7.0;
  const auto other = open(options);
  ASSERT_TRUE(other);
  EXPECT_EQ(other->plan().inputs[0].noData, "7");
  const auto otherTile = read(*other, {0, 0, 0});
  EXPECT_EQ(otherTile.at(1, 3), -9999.0F);
  EXPECT_TRUE(otherTile.voidAt(2, 3));
  EXPECT_TRUE(otherTile.voidAt(6, 3));
}

TEST(Source, KnowsFloatNoDataHoweverItIsWritten) {
  TempFolder folder;
  for (const double declared : {-3.4028234663852886e+38, -3.4028235e+38, -3.40282306073709652508e+38}) {
    writeRaster(folder / "a.tif", {.noData = declared, .heightAt = [&](int col, int) {
                                     return col == 1 ? -3.4028234663852886e+38 : 5.0;
                                   }});
    const auto source = open(from({folder / "a.tif"}));
    ASSERT_TRUE(source);
    EXPECT_TRUE(read(*source, {0, 0, 0}).voidAt(1, 0)) << declared;
  }
  writeRaster(folder / "b.tif",
              {.noData = 0.1, .heightAt = [](int col, int) { return col == 1 ? 0.1 : 5.0; }});
  const auto source = open(from({folder / "b.tif"}));
  ASSERT_TRUE(source);
  EXPECT_TRUE(read(*source, {0, 0, 0}).voidAt(1, 0));
}

TEST(Source, IgnoresNoDataThatTheTypeCannotHold) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.type = GDT_Byte, .noData = -9999.0, .heightAt = [](int col, int) {
                                   return col == 1 ? 0.0 : 255.0;
                                 }});
  ListeningProgress listening;
  const auto source = openSource(from({folder / "a.tif"}), listening);
  ASSERT_TRUE(source.ok()) << source.error().message;
  EXPECT_HAS(listening.all(), "nodata -9999 cannot occur in Byte values and is ignored");
  EXPECT_EQ((*source)->plan().inputs[0].noData, "");
  const auto tile = read(**source, {0, 0, 0});
  EXPECT_EQ(tile.at(1, 0), 0.0F);
  EXPECT_EQ(tile.at(2, 0), 255.0F);
}

TEST(Source, HonoursMasksAndAlpha) {
  TempFolder folder;
  writeRaster(folder / "mask.tif",
              {.mask = true, .maskAt = [](int col, int row) { return col != 4 || row != 2; }});
  const auto masked = open(from({folder / "mask.tif"}));
  ASSERT_TRUE(masked);
  EXPECT_EQ(masked->plan().inputs[0].noData, "mask");
  const auto tile = read(*masked, {0, 0, 0});
  EXPECT_TRUE(tile.voidAt(4, 2));
  EXPECT_EQ(tile.at(5, 2), 205.0F);

  // Alpha: the second band of two.
  writeRaster(folder / "alpha.tif", {.type = GDT_UInt16, .creation = {"ALPHA=YES"}, .bands = 2});
  {
    auto* dataset = GDALDataset::Open((folder / "alpha.tif").c_str(), GDAL_OF_UPDATE);
    ASSERT_NE(dataset, nullptr);
    std::vector<uint16_t> alpha(40 * 30, 65535);
    alpha[2 * 40 + 4] = 0;
    ASSERT_EQ(dataset->GetRasterBand(2)->RasterIO(GF_Write, 0, 0, 40, 30, alpha.data(), 40, 30, GDT_UInt16, 0,
                                                  0, nullptr),
              CE_None);
    GDALClose(dataset);
  }
  const auto alpha = open(from({folder / "alpha.tif"}));
  ASSERT_TRUE(alpha);
  const auto alphaTile = read(*alpha, {0, 0, 0});
  EXPECT_TRUE(alphaTile.voidAt(4, 2));
  EXPECT_EQ(alphaTile.at(5, 2), 205.0F);
}

TEST(Source, HonoursScaleOffsetAndUnits) {
  TempFolder folder;
  writeRaster(folder / "a.tif",
              {.type = GDT_Int16, .scale = 0.1, .offset = 50.0, .heightAt = [](int c, int) { return c; }});
  const auto source = open(from({folder / "a.tif"}));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->plan().maxErrorMeters, 0.0);
  EXPECT_EQ(source->plan().heightStep, 0.1);
  EXPECT_EQ(source->plan().heightOffset, 50.0);
  EXPECT_EQ(read(*source, {0, 0, 0}).at(7, 0), static_cast<float>(50.0 + 7 * 0.1));

  // Feet of all kinds; an unknown unit is named.
  const std::vector<std::pair<std::string, double>> units = {{"ft", 0.3048},
                                                             {"foot", 0.3048},
                                                             {"Feet", 0.3048},
                                                             {"US survey foot", 1200.0 / 3937.0},
                                                             {"us-ft", 1200.0 / 3937.0},
                                                             {"ftUS", 1200.0 / 3937.0},
                                                             {"metre", 1.0},
                                                             {"m", 1.0},
                                                             {"cm", 0.01},
                                                             {"km", 1000.0}};
  for (const auto& [unit, meters] : units) {
    writeRaster(folder / "b.tif", {.unit = unit, .heightAt = [](int, int) { return 3.0; }});
    const auto inUnit = open(from({folder / "b.tif"}));
    ASSERT_TRUE(inUnit);
    EXPECT_EQ(read(*inUnit, {0, 0, 0}).at(0, 0), static_cast<float>(3.0 * meters)) << unit;
  }
  writeRaster(folder / "c.tif", {.unit = "parsec"});
  ListeningProgress listening;
  ASSERT_TRUE(openSource(from({folder / "c.tif"}), listening).ok());
  EXPECT_HAS(listening.all(), "unknown height unit 'parsec'");
}

TEST(Source, TakesTheHeightUnitFromAVerticalCrs) {
  TempFolder folder;
  writeRaster(folder / "a.tif",
              {.crs = "EPSG:26910", .verticalCrs = "EPSG:6360", .heightAt = [](int, int) { return 1000.0; }});
  const auto source = open(from({folder / "a.tif"}));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->plan().verticalDatum, "NAVD88 height");
  EXPECT_EQ(source->plan().crsName, "NAD83 / UTM zone 10N");
  EXPECT_NEAR(read(*source, {0, 0, 0}).at(0, 0), 304.8006, 1e-3);
}

TEST(Source, ReadsTheExtremesOfIntegers) {
  TempFolder folder;
  writeRaster(folder / "a.tif",
              {.type = GDT_Int16, .heightAt = [](int c, int) { return c % 2 == 0 ? -32768.0 : 32767.0; }});
  const auto source = open(from({folder / "a.tif"}));
  ASSERT_TRUE(source);
  const auto tile = read(*source, {0, 0, 0});
  EXPECT_EQ(tile.at(0, 0), -32768.0F);
  EXPECT_EQ(tile.at(1, 0), 32767.0F);

  // What the step cannot hold is an error that tells the way out.
  writeRaster(folder / "b.tif",
              {.type = GDT_Int32, .heightAt = [](int c, int) { return c == 3 ? 2147483647.0 : 1.0; }});
  const auto wide = open(from({folder / "b.tif"}));
  ASSERT_TRUE(wide);
  const auto failed = tryRead(*wide, {0, 0, 0});
  ASSERT_FALSE(failed.ok());
  EXPECT_HAS(failed.error().message, "b.tif: a height of");
  EXPECT_HAS(failed.error().message, "--max-error");
}

TEST(Source, TurnsRastersThatRunTheOtherWay) {
  TempFolder folder;
  writeRaster(folder / "up.tif", {.geoTransform = {499995.0, 10.0, 0.0, 4999705.0, 0.0, 10.0}});
  const auto up = open(from({folder / "up.tif"}));
  ASSERT_TRUE(up);
  EXPECT_FALSE(up->plan().inputs[0].warped);
  EXPECT_EQ(up->plan().frame.originNorthing, 5000000.0);
  const auto tile = read(*up, {0, 0, 0});
  EXPECT_EQ(tile.at(3, 0), 100.0F + 3 + 50 * 29);
  EXPECT_EQ(tile.at(3, 29), 103.0F);
  EXPECT_TRUE(tile.voidAt(3, 30));

  writeRaster(folder / "left.tif",
              {.width = 400, .geoTransform = {503995.0, -10.0, 0.0, 5000005.0, 0.0, -10.0}});
  const auto left = open(from({folder / "left.tif"}));
  ASSERT_TRUE(left);
  EXPECT_FALSE(left->plan().inputs[0].warped);
  EXPECT_EQ(read(*left, {1, 0, 0}).at(0, 2), 100.0F + 399 + 100);
  EXPECT_EQ(read(*left, {1, 1, 0}).at(143, 2), 200.0F);
}

TEST(Source, LaysLaterInputsOnTop) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.heightAt = [](int, int) { return 1.0; }});
  // Ten columns further east, ten rows further north, with a hole.
  writeRaster(folder / "b.tif", {.geoTransform = {500095.0, 10.0, 0.0, 5000105.0, 0.0, -10.0},
                                 .noData = -1.0,
                                 .heightAt = [](int c, int r) { return c == 5 && r == 15 ? -1.0 : 2.0; }});
  const auto both = open(from({folder / "a.tif", folder / "b.tif"}));
  ASSERT_TRUE(both);
  EXPECT_EQ(both->plan().frame.originEasting, 500000.0);
  EXPECT_EQ(both->plan().frame.originNorthing, 5000100.0);
  EXPECT_EQ(both->plan().extentCols, 50);
  EXPECT_EQ(both->plan().extentRows, 40);
  const auto tile = read(*both, {0, 0, 0});
  EXPECT_TRUE(tile.voidAt(0, 0));
  EXPECT_EQ(tile.at(10, 0), 2.0F);
  EXPECT_EQ(tile.at(10, 12), 2.0F);
  EXPECT_EQ(tile.rankAt(10, 12), 2);
  EXPECT_EQ(tile.at(15, 15), 1.0F);  // through the hole
  EXPECT_EQ(tile.rankAt(15, 15), 1);
  EXPECT_TRUE(tile.voidAt(49, 39));

  const auto swapped = open(from({folder / "b.tif", folder / "a.tif"}));
  ASSERT_TRUE(swapped);
  EXPECT_EQ(read(*swapped, {0, 0, 0}).at(10, 12), 1.0F);
}

TEST(Source, KeepsCoarserInputsOnTheirOwnLevel) {
  TempFolder folder;
  writeRaster(folder / "fine.tif", {.width = 300, .height = 300});
  // Four times coarser, its samples on every fourth of the fine one's, but not from the first.
  writeRaster(folder / "coarse.tif",
              {.width = 100,
               .height = 90,
               .geoTransform = {499990.0 - 400.0, 40.0, 0.0, 5000030.0 + 200, 0.0, -40.0},
               .heightAt = [](int c, int r) { return 1000.0 + c + r; }});
  const auto source = open(from({folder / "fine.tif", folder / "coarse.tif"}));
  ASSERT_TRUE(source);
  const auto& plan = source->plan();
  EXPECT_EQ(plan.frame.spacingX, 10.0);
  EXPECT_EQ(plan.frame.finestLevel, 2);
  EXPECT_FALSE(plan.inputs[0].warped);
  EXPECT_FALSE(plan.inputs[1].warped);
  EXPECT_EQ(plan.inputs[0].nativeLevel, 2);
  EXPECT_EQ(plan.inputs[1].nativeLevel, 0);
  EXPECT_EQ(source->nativeLevels(), (std::vector<int>{0, 2}));

  // Its north-western sample is the origin, forty fine columns west and twenty-two rows north of the other's.
  EXPECT_EQ(plan.frame.originEasting, 499610.0);
  EXPECT_EQ(plan.frame.originNorthing, 5000210.0);
  const auto coarse = read(*source, {0, 0, 0});
  EXPECT_EQ(coarse.at(7, 9), 1016.0F);
  EXPECT_EQ(coarse.rankAt(7, 9), 2);
  const auto fine = read(*source, {2, 0, 0});
  EXPECT_TRUE(fine.voidAt(38, 21));
  EXPECT_EQ(fine.at(39, 21), 100.0F);
  EXPECT_EQ(fine.rankAt(39, 21), 1);
  EXPECT_FALSE(read(*source, {1, 0, 0}).any);

  // Between the fine one's samples it is warped, still on its own level.
  writeRaster(folder / "between.tif",
              {.width = 100, .height = 90, .geoTransform = {499593.0, 40.0, 0.0, 5000230.0, 0.0, -40.0}});
  const auto between = open(from({folder / "fine.tif", folder / "between.tif"}));
  ASSERT_TRUE(between);
  EXPECT_TRUE(between->plan().inputs[1].warped);
  EXPECT_EQ(between->plan().inputs[1].nativeLevel, between->plan().frame.finestLevel - 2);
}

TEST(Source, WarpsWhatDoesNotFitTheGrid) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.width = 300, .height = 300});
  struct Case {
    const char* what;
    std::array<double, 6> transform;
  };
  const Case cases[] = {{"half a sample off", {500000.0, 10.0, 0.0, 5000000.0, 0.0, -10.0}},
                        {"another spacing", {499995.0, 10.3, 0.0, 5000005.0, 0.0, -10.3}},
                        {"not square", {499995.0, 10.0, 0.0, 5000005.0, 0.0, -15.0}},
                        {"rotated", {499995.0, 12.0, 3.0, 5000005.0, 3.0, -12.0}}};
  for (const auto& one : cases) {
    writeRaster(folder / "b.tif",
                {.width = 200, .height = 200, .geoTransform = one.transform, .heightAt = [](int c, int r) {
                   return c + r;
                 }});
    const auto source = open(from({folder / "a.tif", folder / "b.tif"}));
    ASSERT_TRUE(source) << one.what;
    EXPECT_FALSE(source->plan().inputs[0].warped) << one.what;
    EXPECT_TRUE(source->plan().inputs[1].warped) << one.what;
    EXPECT_EQ(source->plan().inputs[1].resampling, "cubic");
  }
}

TEST(Source, WarpedHeightsAreTheGroundsHeights) {
  // A plane in UTM 32, asked for in UTM 33: heights at a place must be those of the plane there.
  TempFolder folder;
  writeRaster(folder / "a.tif", {.width = 200, .height = 200, .heightAt = [](int c, int r) {
                                   return 500.0 + 0.5 * c - 0.25 * r;
                                 }});
  auto options = from({folder / "a.tif"});
  options.crs = "EPSG:32633";
  const auto source = open(options);
  ASSERT_TRUE(source);
  const Frame& frame = source->plan().frame;
  EXPECT_TRUE(source->plan().inputs[0].warped);
  EXPECT_NEAR(frame.spacingX, 10.0, 0.2);
  EXPECT_NEAR(source->plan().maxErrorMeters, frame.spacingX / 200, 1e-12);

  OGRSpatialReference from33;
  OGRSpatialReference to32;
  from33.importFromEPSG(32633);
  to32.importFromEPSG(32632);
  from33.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  to32.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> back(OGRCreateCoordinateTransformation(&from33, &to32));
  const auto tile = read(*source, {frame.finestLevel, 0, 0});
  int seen = 0;
  for (int y = 0; y < kTileSamples; y += 3) {
    for (int x = 0; x < kTileSamples; x += 3) {
      double easting = frame.originEasting + x * frame.spacingX;
      double northing = frame.originNorthing - y * frame.spacingY;
      ASSERT_TRUE(back->Transform(1, &easting, &northing));
      const double col = (easting - 500000.0) / 10.0;
      const double row = (5000000.0 - northing) / 10.0;
      if (col < 2 || col > 197 || row < 2 || row > 197) continue;
      ASSERT_FALSE(tile.voidAt(x, y)) << x << " " << y;
      EXPECT_NEAR(tile.at(x, y), 500.0 + 0.5 * col - 0.25 * row, 2e-3);
      ++seen;
    }
  }
  EXPECT_GT(seen, 2000);
}

TEST(Source, TakesASpacingOfOnesChoice) {
  // Waves of four samples of 10 m over a plane: seen by every third or fourth sample alone they would beat.
  TempFolder folder;
  const auto plane = [](double easting, double northing) {
    return 300.0 + 0.02 * (easting - 500000.0) + 0.01 * (northing - 5000000.0);
  };
  writeRaster(folder / "a.tif", {.width = 400, .height = 300, .heightAt = [&](int c, int r) {
                                   return plane(500000.0 + 10.0 * c, 5000000.0 - 10.0 * r) +
                                          (c % 4 < 2 ? 5.0 : -5.0);
                                 }});
  auto options = from({folder / "a.tif"});
  options.spacing = 45.0;
  const auto source = open(options);
  ASSERT_TRUE(source);
  const SourcePlan& plan = source->plan();
  EXPECT_EQ(plan.frame.spacingX, 45.0);
  EXPECT_EQ(plan.frame.spacingY, 45.0);
  EXPECT_EQ(std::fmod(plan.frame.originEasting, 45.0), 0.0);
  EXPECT_EQ(std::fmod(plan.frame.originNorthing, 45.0), 0.0);
  EXPECT_NEAR(static_cast<double>(plan.extentCols), 400 * 10.0 / 45.0, 1.0);
  EXPECT_TRUE(plan.inputs[0].warped);
  const auto offPlane = [&](const std::string& resampling) {
    options.resampling = resampling;
    const auto other = open(options);
    EXPECT_EQ(other->plan().inputs[0].resampling, resampling);
    const auto tile = read(*other, {plan.frame.finestLevel, 0, 0});
    double most = 0.0;
    for (int y = 2; y < 60; ++y) {
      for (int x = 2; x < 80; ++x) {
        const double at = plane(plan.frame.originEasting + 45.0 * x, plan.frame.originNorthing - 45.0 * y);
        EXPECT_FALSE(tile.voidAt(x, y)) << x << " " << y;
        most = std::max(most, std::abs(tile.at(x, y) - at));
      }
    }
    return most;
  };
  EXPECT_LT(offPlane("cubic"), 1.5);
  EXPECT_LT(offPlane("bilinear"), 1.5);
  EXPECT_GT(offPlane("near"), 4.0);

  // An input's own spacing, or none that is finer than all of them.
  options.spacing = 10.0;
  EXPECT_FALSE(open(options)->plan().inputs[0].warped);
  options.spacing = 4.0;
  EXPECT_HAS(openError(options), "--spacing 4");
  EXPECT_HAS(openError(options), "every 10");
  options.spacing = std::nan("");
  EXPECT_HAS(openError(options), "--spacing");

  // Of several inputs the one that has it lends its grid, the finer ones are warped onto it.
  writeRaster(folder / "b.tif",
              {.width = 60, .height = 60, .geoTransform = {499993.0, 30.0, 0.0, 5000007.0, 0.0, -30.0}});
  options = from({folder / "a.tif", folder / "b.tif"});
  options.spacing = 30.0;
  const auto both = open(options);
  ASSERT_TRUE(both);
  EXPECT_TRUE(both->plan().inputs[0].warped);
  EXPECT_FALSE(both->plan().inputs[1].warped);
  EXPECT_EQ(both->plan().inputs[0].nativeLevel, both->plan().frame.finestLevel);
}

TEST(Source, ChoosesTheHeightStep) {
  TempFolder folder;
  writeRaster(folder / "int.tif", {.type = GDT_Int16});
  writeRaster(folder / "float.tif", {});
  writeRaster(folder / "scaled.tif", {.type = GDT_Int16, .scale = 0.5});
  const auto integers = open(from({folder / "int.tif"}));
  ASSERT_TRUE(integers);
  EXPECT_EQ(integers->plan().maxErrorMeters, 0.0);
  EXPECT_EQ(integers->plan().heightStep, 1.0);

  // Floats: a two-hundredth of the spacing, held with rounding.
  const auto floats = open(from({folder / "float.tif"}));
  ASSERT_TRUE(floats);
  EXPECT_EQ(floats->plan().maxErrorMeters, 0.05);
  EXPECT_LT(floats->plan().heightStep, 0.1);
  EXPECT_GT(floats->plan().heightStep, 0.09);

  auto options = from({folder / "int.tif"});
  options.maxErrorMeters = 3.0;
  const auto bounded = open(options);
  ASSERT_TRUE(bounded);
  EXPECT_EQ(bounded->plan().maxErrorMeters, 3.0);
  EXPECT_EQ(bounded->plan().heightStep, 1.25 * 3.0);
  EXPECT_TRUE(bounded->plan().interpolates);

  // The less a bound allows, the nearer its double is the step; samples of several levels are all coded.
  options.maxErrorMeters = 1.5;
  EXPECT_EQ(open(options)->plan().heightStep, 1.5 * 1.5);
  options.maxErrorMeters = 0.5;
  EXPECT_NEAR(open(options)->plan().heightStep, 1.0, 0.02);
  EXPECT_TRUE(open(options)->plan().interpolates);
  options.maxErrorMeters = 0.09;
  EXPECT_FALSE(open(options)->plan().interpolates);
  writeRaster(folder / "coarse.tif",
              {.type = GDT_Int16, .geoTransform = {499990.0, 20.0, 0.0, 5000010.0, 0.0, -20.0}});
  options = from({folder / "int.tif", folder / "coarse.tif"});
  options.maxErrorMeters = 3.0;
  const auto mixed = open(options);
  ASSERT_TRUE(mixed);
  EXPECT_FALSE(mixed->plan().interpolates);
  EXPECT_NEAR(mixed->plan().heightStep, 6.0, 0.1);

  options = from({folder / "float.tif"});
  options.lossless = true;
  EXPECT_HAS(openError(options), "float.tif: its values are not integers");
  options = from({folder / "int.tif", folder / "scaled.tif"});
  options.lossless = true;
  EXPECT_HAS(openError(options), "scaled.tif: its scale, offset or unit differs");
  options = from({folder / "int.tif"});
  options.lossless = true;
  options.crs = "EPSG:32633";
  EXPECT_HAS(openError(options), "has to be warped");
  options.crs.clear();
  options.maxErrorMeters = 1.0;
  EXPECT_HAS(openError(options), "exclude each other");
  options.lossless = false;
  options.maxErrorMeters = -1.0;
  EXPECT_HAS(openError(options), "--max-error -1");
}

TEST(Source, AStepKeepsItsBoundInFloats) {
  // The largest error of quantising to floats, over heights that the plan allows, is within the bound.
  TempFolder folder;
  for (const double bound : {0.001, 0.005, 0.02, 0.0625, 0.45, 5.0}) {
    writeRaster(folder / "a.tif", {});
    auto options = from({folder / "a.tif"});
    options.maxErrorMeters = bound;
    const auto source = open(options);
    ASSERT_TRUE(source);
    const ElevationScale scale{.heightStep = source->plan().heightStep};
    for (int i = 0; i < 20000; ++i) {
      const auto height = static_cast<float>(-400.0 + i * 0.4391 + i * 1e-5);
      if (std::abs(height) > 4000.0F && bound < 0.005) continue;
      const double steps = std::round(height / scale.heightStep);
      const float stored = scale.heightFromInteger(static_cast<int64_t>(steps));
      ASSERT_LE(std::abs(static_cast<double>(stored) - static_cast<double>(height)), bound) << height;
    }
  }
}

TEST(Source, ReadersWorkSideBySide) {
  TempFolder folder;
  for (const char* crs : {"EPSG:32632", "EPSG:32633"}) {
    writeRaster(folder / "a.tif", {.width = 700,
                                   .height = 600,
                                   .heightAt = [](int c, int r) { return 2.0 * c + r; },
                                   .creation = {"COMPRESS=DEFLATE", "TILED=YES"}});
    auto options = from({folder / "a.tif"});
    options.crs = crs;
    const auto source = open(options);
    ASSERT_TRUE(source);
    const int level = source->plan().frame.finestLevel;
    const auto once = read(*source, {level, 1, 1});
    std::vector<std::thread> threads;
    std::atomic<int> same{0};
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([&] {
        auto reader = source->openReader();
        std::vector<float> heights(kTileSampleCount);
        std::vector<uint16_t> ranks(kTileSampleCount);
        for (const TileId id : {TileId{level, 0, 0}, TileId{level, 1, 1}}) {
          if (!(*reader)->readTile(id, heights, ranks).ok()) return;
        }
        if (std::memcmp(heights.data(), once.heights.data(), heights.size() * sizeof(float)) == 0) ++same;
      });
    }
    for (auto& thread : threads) thread.join();
    EXPECT_EQ(same.load(), 4) << crs;
  }
}

}  // namespace
}  // namespace terrane
