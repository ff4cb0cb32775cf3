#pragma once

#include <gdalwarper.h>

#include <array>
#include <limits>
#include <memory>
#include <span>
#include <string>

#include "input_raster.h"
#include "terrane/base/result.h"

namespace terrane {

/// A sample where there is none.
inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Where an input comes to lie in another CRS, pixel edges included, in that CRS's units.
struct WarpPlan {
  double west = 0.0;
  double east = 0.0;
  double south = 0.0;
  double north = 0.0;
  double spacing = 1.0;  ///< square; GDAL's suggestion (as many pixels on the diagonal), four digits
};

/// Plans an input's way into `targetWkt`. Errors name the file: no transformation, a place beyond the
/// target's domain, or so near its edge that the input's pixels become many times as large there as in its
/// middle.
Result<WarpPlan> planWarp(const InputRaster& raster, GDALDataset& dataset, const std::string& targetWkt);

/// How samples are made from an input's.
struct WarpKernel {
  std::string resampling = "cubic";  ///< of resamplingNames()
  /// The input's pixels a sample of the lattice, inverted: where below 1, the kernel is as wide as its
  /// samples.
  double scaleX = 1.0;
  double scaleY = 1.0;
};

/// The kernel of an input that is planned to lie so, on samples that are `spacingX` x `spacingY` apart.
WarpKernel planKernel(const std::string& resampling, const WarpPlan& plan, const InputRaster& raster,
                      double spacingX, double spacingY);

/// Pixels of the input around a window that the kernel may look at.
std::string sourceExtra(const WarpKernel& kernel);

/// Warps one input onto a lattice, window by window: float32, exact transformer. Any two windows
/// agree bit for bit where they overlap: the kernel has one fixed width, and always takes the same path.
class Warper {
 public:
  /// `geoTransform` is the lattice's, of pixel edges around its samples, north up. The dataset must outlive
  /// the warper; both belong to one thread.
  static Result<std::unique_ptr<Warper>> open(const InputRaster& raster, GDALDataset& dataset,
                                              const std::string& targetWkt,
                                              const std::array<double, 6>& geoTransform,
                                              const WarpKernel& kernel);
  ~Warper();
  Warper(const Warper&) = delete;
  Warper& operator=(const Warper&) = delete;

  /// Heights in metres of a window of the lattice, row by row, NaN where the input has none.
  Status read(int col, int row, int cols, int rows, std::span<float> heights);

 private:
  explicit Warper(const InputRaster& raster) : raster_(raster) {}
  const InputRaster& raster_;
  void* transformer_ = nullptr;
  GDALWarpOperation operation_;
};

}  // namespace terrane
