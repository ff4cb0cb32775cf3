#pragma once

#include "made_raster.h"

namespace terrane::test {

/// A picture to write; the defaults are 400 x 300 RGB pixels of 1 m over the default MadeRaster (whose first
/// sample is at 500000, 5000000: so pixel edges lie on samples).
struct MadePicture {
  int width = 400;
  int height = 300;
  int bands = 3;
  GDALDataType type = GDT_Byte;
  std::string crs = "EPSG:32632";
  std::array<double, 6> geoTransform = {500000.0, 1.0, 0.0, 5000000.0, 0.0, -1.0};
  std::optional<double> noData = std::nullopt;
  bool alpha = false;  ///< the last band
  std::vector<std::array<short, 3>> palette = {};
  std::function<double(int band, int col, int row)> valueAt = [](int, int, int) { return 100.0; };
};

inline void writePicture(const std::string& path, const MadePicture& made) {
  GDALAllRegister();
  CPLStringList creation;
  if (made.bands >= 3 && made.palette.empty()) creation.AddString("PHOTOMETRIC=RGB");
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  GDALDataset* dataset =
      driver->Create(path.c_str(), made.width, made.height, made.bands, made.type, creation.List());
  ASSERT_NE(dataset, nullptr) << path;
  auto transform = made.geoTransform;
  if (transform[1] != 0.0) dataset->SetGeoTransform(transform.data());
  if (!made.crs.empty()) {
    OGRSpatialReference crs;
    ASSERT_EQ(crs.SetFromUserInput(made.crs.c_str()), OGRERR_NONE);
    dataset->SetSpatialRef(&crs);
  }
  if (!made.palette.empty()) {
    GDALColorTable table;
    for (size_t i = 0; i < made.palette.size(); ++i) {
      const GDALColorEntry entry{made.palette[i][0], made.palette[i][1], made.palette[i][2], 255};
      table.SetColorEntry(static_cast<int>(i), &entry);
    }
    dataset->GetRasterBand(1)->SetColorTable(&table);
  }
  for (int band = 1; band <= made.bands; ++band) {
    GDALRasterBand& to = *dataset->GetRasterBand(band);
    if (made.alpha && band == made.bands)
      to.SetColorInterpretation(GCI_AlphaBand);
    else if (made.noData)
      to.SetNoDataValue(*made.noData);
    std::vector<double> line(static_cast<size_t>(made.width));
    for (int row = 0; row < made.height; ++row) {
      for (int col = 0; col < made.width; ++col)
        line[static_cast<size_t>(col)] = made.valueAt(band, col, row);
      ASSERT_EQ(to.RasterIO(GF_Write, 0, row, made.width, 1, line.data(), made.width, 1, GDT_Float64, 0, 0,
                            nullptr),
                CE_None);
    }
  }
  GDALClose(dataset);
}

}  // namespace terrane::test
