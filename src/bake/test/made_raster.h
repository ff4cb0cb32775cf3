#pragma once

#include <cpl_string.h>
#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

/// Small rasters on disk for the tests of the inputs.
namespace terrane::test {

/// A folder that goes with the test.
class TempFolder {
 public:
  TempFolder() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() / (std::string("terrane_") + info->test_suite_name() +
                                                      "_" + info->name() + "_" + std::to_string(::getpid()));
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TempFolder() {
    std::error_code code;
    std::filesystem::remove_all(path_, code);
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  std::string str() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

/// What to write; the defaults are a 40 x 30 float raster of 10 m in UTM 32N whose first pixel's centre is
/// at (500000, 5000000). A transform of zeros is not written.
struct MadeRaster {
  int width = 40;
  int height = 30;
  GDALDataType type = GDT_Float32;
  std::string crs = "EPSG:32632";
  std::array<double, 6> geoTransform = {499995.0, 10.0, 0.0, 5000005.0, 0.0, -10.0};
  std::optional<double> noData = std::nullopt;
  std::optional<double> scale = std::nullopt;
  std::optional<double> offset = std::nullopt;
  std::string unit = {};
  std::string verticalCrs = {};  ///< makes the CRS compound
  bool mask = false;             ///< with a mask band: pixels where maskAt() is 0 are void
  std::function<double(int, int)> heightAt = [](int col, int row) { return 100.0 + col + 50.0 * row; };
  std::function<bool(int, int)> maskAt = [](int, int) { return true; };
  std::vector<std::string> creation = {};  ///< creation options, "COMPRESS=LZW"
  int bands = 1;
};

inline void writeRaster(const std::string& path, const MadeRaster& made) {
  GDALAllRegister();
  CPLStringList creation;
  for (const auto& option : made.creation) creation.AddString(option.c_str());
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  GDALDataset* dataset =
      driver->Create(path.c_str(), made.width, made.height, made.bands, made.type, creation.List());
  ASSERT_NE(dataset, nullptr) << path;
  auto transform = made.geoTransform;
  if (transform[1] != 0.0 || transform[2] != 0.0) dataset->SetGeoTransform(transform.data());
  if (!made.crs.empty()) {
    OGRSpatialReference crs;
    ASSERT_EQ(crs.SetFromUserInput(made.crs.c_str()), OGRERR_NONE);
    if (!made.verticalCrs.empty()) {
      OGRSpatialReference vertical;
      ASSERT_EQ(vertical.SetFromUserInput(made.verticalCrs.c_str()), OGRERR_NONE);
      OGRSpatialReference compound;
      compound.SetCompoundCS("both", &crs, &vertical);
      crs = compound;
    }
    dataset->SetSpatialRef(&crs);
  }
  GDALRasterBand* band = dataset->GetRasterBand(1);
  if (made.noData) band->SetNoDataValue(*made.noData);
  if (made.scale) band->SetScale(*made.scale);
  if (made.offset) band->SetOffset(*made.offset);
  if (!made.unit.empty()) band->SetUnitType(made.unit.c_str());
  std::vector<double> line(static_cast<size_t>(made.width));
  for (int row = 0; row < made.height; ++row) {
    for (int col = 0; col < made.width; ++col) line[static_cast<size_t>(col)] = made.heightAt(col, row);
    ASSERT_EQ(band->RasterIO(GF_Write, 0, row, made.width, 1, line.data(), made.width, 1, GDT_Float64, 0, 0,
                             nullptr),
              CE_None);
  }
  if (made.mask) {
    const CPLConfigOptionSetter internal("GDAL_TIFF_INTERNAL_MASK", "YES", false);
    ASSERT_EQ(dataset->CreateMaskBand(GMF_PER_DATASET), CE_None);
    std::vector<uint8_t> bits(static_cast<size_t>(made.width));
    for (int row = 0; row < made.height; ++row) {
      for (int col = 0; col < made.width; ++col)
        bits[static_cast<size_t>(col)] = made.maskAt(col, row) ? 255 : 0;
      ASSERT_EQ(band->GetMaskBand()->RasterIO(GF_Write, 0, row, made.width, 1, bits.data(), made.width, 1,
                                              GDT_Byte, 0, 0, nullptr),
                CE_None);
    }
  }
  GDALClose(dataset);
}

}  // namespace terrane::test
