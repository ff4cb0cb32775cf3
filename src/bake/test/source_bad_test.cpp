#include <gtest/gtest.h>

#include <fstream>

#include "source_support.h"

namespace terrane {
namespace {

using test::from;
using test::open;
using test::openError;
using test::TempFolder;
using test::writeRaster;

TEST(SourceBad, NamesTheFileAndTheRemedy) {
  TempFolder folder;
  EXPECT_HAS(openError(from({folder / "missing.tif"})), "missing.tif: there is no such file");
  std::ofstream(folder / "text.tif") << "these are words, not heights\n";
  EXPECT_HAS(openError(from({folder / "text.tif"})), "text.tif: not a raster that GDAL can open");
  std::ofstream(folder / "empty.tif").close();
  EXPECT_HAS(openError(from({folder / "empty.tif"})), "empty.tif: the file is empty");
  writeRaster(folder / "one.tif", {.width = 1, .height = 1});
  EXPECT_HAS(openError(from({folder / "one.tif"})), "needs at least 2 x 2 samples");
  writeRaster(folder / "thin.tif", {.width = 1, .height = 30});
  EXPECT_HAS(openError(from({folder / "thin.tif"})), "needs at least 2 x 2 samples");
  writeRaster(folder / "complex.tif", {.type = GDT_CFloat32});
  EXPECT_HAS(openError(from({folder / "complex.tif"})), "complex numbers");
  writeRaster(folder / "nowhere.tif", {.geoTransform = {}});
  EXPECT_HAS(openError(from({folder / "nowhere.tif"})), "nowhere.tif: does not say where it lies");
}

TEST(SourceBad, RefusesPalettes) {
  TempFolder folder;
  writeRaster(folder / "palette.tif", {.type = GDT_Byte, .creation = {"PHOTOMETRIC=PALETTE"}});
  EXPECT_HAS(openError(from({folder / "palette.tif"})), "colour palette");
}

TEST(SourceBad, TinyRastersWork) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.width = 2, .height = 3});
  const auto source = open(from({folder / "a.tif"}));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->plan().frame.finestLevel, 0);
  const auto tile = test::read(*source, {0, 0, 0});
  EXPECT_EQ(tile.at(1, 2), 201.0F);
  EXPECT_TRUE(tile.voidAt(2, 2));

  auto options = from({folder / "a.tif"});
  options.crs = "EPSG:32633";
  SilentProgress silent;
  const auto warped = openSource(options, silent);
  if (!warped.ok()) {
    EXPECT_HAS(warped.error().message, "too small");
  }
}

TEST(SourceBad, TruncatedFilesAreErrorsNotZeros) {
  TempFolder folder;
  const struct {
    const char* name;
    std::vector<std::string> creation;
  } cases[] = {
      {"plain.tif", {}}, {"deflate.tif", {"COMPRESS=DEFLATE"}}, {"tiled.tif", {"TILED=YES", "COMPRESS=LZW"}}};
  for (const auto& one : cases) {
    for (const char* crs : {"", "EPSG:32633"}) {
      SCOPED_TRACE(std::string(one.name) + " " + crs);
      writeRaster(folder / one.name, {.width = 300, .height = 300, .creation = one.creation});
      const auto bytes = std::filesystem::file_size(folder / one.name);
      std::filesystem::resize_file(folder / one.name, bytes / 2);
      auto options = from({folder / one.name});
      options.crs = crs;
      SilentProgress silent;
      const auto source = openSource(options, silent);

      // Either the headers are lost, or reading the lost samples fails.
      std::string message;
      if (!source.ok()) message = source.error().message;
      for (int tile = 0; message.empty() && tile < 4; ++tile) {
        const auto result = test::tryRead(**source, {1, tile % 2, tile / 2});
        if (!result.ok()) message = result.error().message;
      }
      EXPECT_HAS(message, one.name);
    }
  }
}

TEST(SourceBad, TooMuchIsSaid) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.geoTransform = {0.0, 0.001, 0.0, 0.0, 0.0, -0.001}});
  writeRaster(folder / "b.tif", {.geoTransform = {2e6, 0.001, 0.0, 0.0, 0.0, -0.001}});
  EXPECT_HAS(openError(from({folder / "a.tif", folder / "b.tif"})), "more than a dataset holds");
}

TEST(SourceBad, GdalKeepsQuiet) {
  TempFolder folder;
  std::ofstream(folder / "text.tif") << "words";
  ::testing::internal::CaptureStderr();
  (void)openError(from({folder / "text.tif"}));
  (void)openError(from({folder / "missing.tif"}));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(SourceBad, AWorldInMercatorHasToBeCut) {
  TempFolder folder;
  writeRaster(
      folder / "world.tif",
      {.width = 360, .height = 180, .crs = "EPSG:4326", .geoTransform = {-180.0, 1.0, 0.0, 90.0, 0.0, -1.0}});
  auto options = from({folder / "world.tif"});
  for (const char* crs : {"EPSG:3857", "EPSG:3031"}) {
    options.crs = crs;
    EXPECT_HAS(openError(options), "too near the edge");
  }
  writeRaster(
      folder / "most.tif",
      {.width = 360, .height = 170, .crs = "EPSG:4326", .geoTransform = {-180.0, 1.0, 0.0, 85.0, 0.0, -1.0}});
  options = from({folder / "most.tif"});
  options.crs = "EPSG:3857";
  const auto source = open(options);
  ASSERT_TRUE(source);
  EXPECT_LT(source->plan().frame.spacingX, 200e3);
  // Nobody asked for 700 m.
  EXPECT_EQ(source->plan().maxErrorMeters, 5.0);
}

}  // namespace
}  // namespace terrane
