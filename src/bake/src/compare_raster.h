#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "input_raster.h"
#include "terrane/base/result.h"
#include "terrane/dataset/manifest.h"

namespace terrane {

/// One raster of a comparison: what it is, and how the manifest says it was taken.
struct ComparedRaster {
  InputRaster raster;
  bool warped = false;
  int nativeLevel = 0;
  std::string resampling = "cubic";  ///< where warped
};

/// Reads one raster for one thread, on the lattice of its native level. Shares nothing with the build's
/// reader but the description of the file.
class ComparedReader {
 public:
  static Result<std::unique_ptr<ComparedReader>> open(const ComparedRaster& compared,
                                                      const Manifest& manifest);
  ~ComparedReader();
  ComparedReader(const ComparedReader&) = delete;
  ComparedReader& operator=(const ComparedReader&) = delete;

  /// Heights in metres of the level's samples [col, col + cols) x [row, row + rows), NaN where there is none;
  /// the window may lie anywhere.
  Status read(int64_t col, int64_t row, int cols, int rows, std::span<float> heights);

 private:
  ComparedReader(const ComparedRaster& compared, const Manifest& manifest)
      : compared_(compared), manifest_(manifest) {}
  Status openWarped();

  const ComparedRaster& compared_;
  const Manifest& manifest_;
  double spacingX_ = 1.0;  // of the native level, CRS units
  double spacingY_ = 1.0;
  GdalDataset file_;
  GdalDataset oneBand_;  // of warped rasters: what is left of the file's bands, then the warped view of it
  GdalDataset warped_;
  std::vector<double> raw_;
  std::vector<uint8_t> mask_;
  std::vector<int> pixelCols_;
  std::vector<int> pixelRows_;
};

}  // namespace terrane
