#pragma once

#include <gdal_priv.h>

#include <memory>
#include <string>
#include <vector>

#include "terrane/base/result.h"

/// The little that every use of GDAL here shares: registration, owners, and GDAL's chatter as values.
namespace terrane {

struct GdalDatasetCloser {
  void operator()(GDALDataset* dataset) const { GDALClose(GDALDataset::ToHandle(dataset)); }
};
/// An open raster; closed when it goes. Belongs to one thread at a time.
using GdalDataset = std::unique_ptr<GDALDataset, GdalDatasetCloser>;

/// Registers GDAL's drivers, once; from any thread.
void registerGdal();

/// Collects what GDAL says on this thread while the object lives; nothing reaches stderr. Objects nest.
class GdalMessages {
 public:
  GdalMessages();
  ~GdalMessages();
  GdalMessages(const GdalMessages&) = delete;
  GdalMessages& operator=(const GdalMessages&) = delete;

  const std::vector<std::string>& warnings() const { return warnings_; }
  const std::vector<std::string>& errors() const { return errors_; }
  /// The first error in GDAL's words, or `otherwise`.
  std::string reason(const std::string& otherwise) const {
    return errors_.empty() ? otherwise : errors_.front();
  }

 private:
  static void CPL_STDCALL collect(CPLErr kind, CPLErrorNum number, const char* text);
  std::vector<std::string> warnings_;
  std::vector<std::string> errors_;
};

/// Opens a raster for reading. Errors name the path, GDAL's reason and a remedy.
Result<GdalDataset> openRaster(const std::string& path);

}  // namespace terrane
