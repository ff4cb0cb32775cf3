#include "terrane/bake/position_raster.h"

#include <gdal_priv.h>

#include <cstdio>
#include <limits>
#include <memory>
#include <vector>

#include "terrane/base/check.h"

namespace terrane {

Status writePositionRaster(const std::string& path, int width, int height,
                           std::span<const glm::dvec3> positionsCrs, const std::string& crsWkt) {
  TERRANE_CHECK(positionsCrs.size() == static_cast<size_t>(width) * static_cast<size_t>(height),
                "{} positions", positionsCrs.size());
  GDALAllRegister();
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  const std::string partial = path + ".partial.tif";
  const char* const options[] = {"COMPRESS=ZSTD", "PREDICTOR=3", "INTERLEAVE=BAND", "BIGTIFF=IF_SAFER",
                                 nullptr};
  const Error cannot = makeError("{}: cannot be written; is the folder there and the disk not full?", path);

  CPLPushErrorHandler(CPLQuietErrorHandler);
  bool good = false;
  if (std::unique_ptr<GDALDataset> file{
          driver->Create(partial.c_str(), width, height, 3, GDT_Float64, const_cast<char**>(options))}) {
    file->SetMetadataItem("COORDINATES_CRS", crsWkt.c_str());
    good = true;
    const char* const names[] = {"easting", "northing", "height"};
    std::vector<double> band(positionsCrs.size());
    for (int b = 0; b < 3 && good; ++b) {
      for (size_t i = 0; i < band.size(); ++i) band[i] = positionsCrs[i][b];
      GDALRasterBand* out = file->GetRasterBand(b + 1);
      out->SetDescription(names[b]);
      out->SetNoDataValue(std::numeric_limits<double>::quiet_NaN());
      good = out->RasterIO(GF_Write, 0, 0, width, height, band.data(), width, height, GDT_Float64, 0, 0) ==
             CE_None;
    }
    CPLErrorReset();
    file.reset();
    good = good && CPLGetLastErrorType() < CE_Failure;
  }
  CPLPopErrorHandler();
  if (good && std::rename(partial.c_str(), path.c_str()) == 0) return {};
  std::remove(partial.c_str());
  return cannot;
}

}  // namespace terrane
