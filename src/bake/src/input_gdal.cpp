#include "input_gdal.h"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_vsi.h>

#include <algorithm>
#include <mutex>
#include <utility>

namespace terrane {

void registerGdal() {
  static std::once_flag once;
  std::call_once(once, [] { GDALAllRegister(); });
}

GdalMessages::GdalMessages() {
  CPLPushErrorHandlerEx(&GdalMessages::collect, this);
}
GdalMessages::~GdalMessages() {
  CPLPopErrorHandler();
}

void CPL_STDCALL GdalMessages::collect(CPLErr kind, CPLErrorNum, const char* text) {
  auto* self = static_cast<GdalMessages*>(CPLGetErrorHandlerUserData());
  auto& list = kind == CE_Warning ? self->warnings_ : self->errors_;
  if (kind < CE_Warning || list.size() >= 100) return;
  if (std::find(list.begin(), list.end(), text) == list.end()) list.emplace_back(text);
}

Result<GdalDataset> openRaster(const std::string& path) {
  registerGdal();
  GdalMessages messages;

  // Sidecars are looked for one by one: listing a folder of thousands for each of its files takes minutes.
  const CPLConfigOptionSetter noListing("GDAL_DISABLE_READDIR_ON_OPEN", "TRUE", true);
  GdalDataset dataset(
      GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR));
  if (dataset) return dataset;

  // Say the commonest reasons in plain words before GDAL's own.
  VSIStatBufL stat;
  if (VSIStatL(path.c_str(), &stat) != 0) {
    return makeError("{}: there is no such file; check the path ({})", path, messages.reason("not found"));
  }
  if (!VSI_ISDIR(stat.st_mode) && stat.st_size == 0)
    return makeError("{}: the file is empty; copy it again", path);
  return makeError("{}: not a raster that GDAL can open ({}); check it with gdalinfo", path,
                   messages.reason("unknown format"));
}

}  // namespace terrane
