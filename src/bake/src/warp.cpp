#include "warp.h"

#include <cpl_conv.h>
#include <cpl_string.h>
#include <gdal_alg.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "input_crs.h"
#include "terrane/bake/source.h"

namespace terrane {
namespace {

// Pixels of the input: two steps of the kernel's reach beyond what a straight line between a window's ends
// leaves out.
constexpr double kSourceExtra = 16.0;

struct NamedResampling {
  const char* name;
  GDALResampleAlg algorithm;
};
constexpr NamedResampling kResamplings[] = {{"near", GRA_NearestNeighbour},
                                            {"bilinear", GRA_Bilinear},
                                            {"cubic", GRA_Cubic},
                                            {"cubicspline", GRA_CubicSpline},
                                            {"lanczos", GRA_Lanczos}};

std::optional<GDALResampleAlg> resamplingNamed(const std::string& name) {
  for (const NamedResampling& one : kResamplings) {
    if (name == one.name) return one.algorithm;
  }
  return std::nullopt;
}

struct WarpOptionsDeleter {
  void operator()(GDALWarpOptions* options) const { GDALDestroyWarpOptions(options); }
};

void* createTransformer(const InputRaster& raster, GDALDataset& dataset, const std::string& targetWkt) {
  CPLStringList options;
  options.SetNameValue("SRC_SRS", crsWkt(raster.crs).c_str());
  options.SetNameValue("DST_SRS", targetWkt.c_str());
  return GDALCreateGenImgProjTransformer2(GDALDataset::ToHandle(&dataset), nullptr, options.List());
}

// How large the input's middle pixel becomes; nothing where that has no place.
std::optional<double> middleSpacing(const InputRaster& raster, void* transformer) {
  std::array<double, 3> x = {0.5 * raster.width, 0.5 * raster.width + 1.0, 0.5 * raster.width};
  std::array<double, 3> y = {0.5 * raster.height, 0.5 * raster.height, 0.5 * raster.height + 1.0};
  std::array<double, 3> z{};
  std::array<int, 3> good{};
  GDALGenImgProjTransform(transformer, FALSE, 3, x.data(), y.data(), z.data(), good.data());
  const double area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
  if (!good[0] || !good[1] || !good[2] || !std::isfinite(area) || area == 0.0) return std::nullopt;
  return std::sqrt(std::abs(area));
}

// Four digits read well and cost nothing: the suggestion is a rule of thumb.
double roundSpacing(double spacing) {
  const double unit = std::pow(10.0, std::floor(std::log10(spacing)) - 3.0);
  const double digits = std::round(spacing / unit);
  return unit >= 1.0 ? digits * unit : digits / std::round(1.0 / unit);
}

}  // namespace

std::span<const char* const> resamplingNames() {
  static const auto names = [] {
    std::array<const char*, std::size(kResamplings)> all{};
    std::transform(std::begin(kResamplings), std::end(kResamplings), all.begin(),
                   [](const NamedResampling& one) { return one.name; });
    return all;
  }();
  return names;
}

Result<WarpPlan> planWarp(const InputRaster& raster, GDALDataset& dataset, const std::string& targetWkt) {
  const GdalMessages messages;
  const auto fail = [&] {
    return makeError(
        "{}: cannot be brought into the dataset's CRS ({}); check its CRS (--source-crs) and --crs",
        raster.path, messages.reason("it lies beyond where that CRS is defined"));
  };
  const std::unique_ptr<void, void (*)(void*)> transformer(createTransformer(raster, dataset, targetWkt),
                                                           &GDALDestroyGenImgProjTransformer);
  if (!transformer) return fail();

  // The spacing is GDAL's suggestion.
  std::array<double, 6> g{};
  std::array<double, 4> extent{};
  int cols = 0;
  int rows = 0;
  if (GDALSuggestedWarpOutput2(GDALDataset::ToHandle(&dataset), GDALGenImgProjTransform, transformer.get(),
                               g.data(), &cols, &rows, extent.data(), 0) != CE_None) {
    return fail();
  }
  WarpPlan plan{extent[0], extent[2], extent[1], extent[3], std::abs(g[1])};
  if (!std::isfinite(plan.spacing) || plan.spacing <= 0.0) return fail();
  plan.spacing = roundSpacing(plan.spacing);
  constexpr double kMostStretched = 8.0;
  if (const auto middle = middleSpacing(raster, transformer.get());
      middle && plan.spacing > kMostStretched * *middle) {
    return makeError(
        "{}: reaches too near the edge of what the dataset's CRS can show: samples would be {:g} units apart "
        "where its middle has one every {:g}; cut it (a world in EPSG:3857: gdal_translate -projwin -180 85 "
        "180 -85), or choose another --crs",
        raster.path, plan.spacing, *middle);
  }

  // The extent is looked at closer than GDAL does, so that no sample at a curved edge is lost.
  constexpr int kSteps = 256;
  std::vector<double> x;
  std::vector<double> y;
  for (int i = 0; i <= kSteps; ++i) {
    const double part = static_cast<double>(i) / kSteps;
    for (const double edge : {0.0, 1.0}) {
      x.insert(x.end(), {part * raster.width, edge * raster.width});
      y.insert(y.end(), {edge * raster.height, part * raster.height});
    }
  }
  std::vector<double> z(x.size(), 0.0);
  std::vector<int> good(x.size(), 0);
  GDALGenImgProjTransform(transformer.get(), FALSE, static_cast<int>(x.size()), x.data(), y.data(), z.data(),
                          good.data());
  for (size_t i = 0; i < x.size(); ++i) {
    if (!good[i] || !std::isfinite(x[i]) || !std::isfinite(y[i])) continue;
    plan.west = std::min(plan.west, x[i]);
    plan.east = std::max(plan.east, x[i]);
    plan.south = std::min(plan.south, y[i]);
    plan.north = std::max(plan.north, y[i]);
  }
  if (!std::isfinite(plan.east - plan.west) || !std::isfinite(plan.north - plan.south)) return fail();
  return plan;
}

WarpKernel planKernel(const std::string& resampling, const WarpPlan& plan, const InputRaster& raster,
                      double spacingX, double spacingY) {
  WarpKernel kernel{resampling};
  // note: whoever is a little finer only, by a rule of thumb, is taken as it is.
  constexpr double kFiner = 0.94;
  if (plan.spacing < kFiner * std::min(spacingX, spacingY)) {
    kernel.scaleX = std::min(1.0, (plan.east - plan.west) / spacingX / raster.width);
    kernel.scaleY = std::min(1.0, (plan.north - plan.south) / spacingY / raster.height);
  }
  return kernel;
}

std::string sourceExtra(const WarpKernel& kernel) {
  return fmt::format("{:.0f}", kSourceExtra / std::min(kernel.scaleX, kernel.scaleY));
}

Result<std::unique_ptr<Warper>> Warper::open(const InputRaster& raster, GDALDataset& dataset,
                                             const std::string& targetWkt,
                                             const std::array<double, 6>& geoTransform,
                                             const WarpKernel& kernel) {
  const GdalMessages messages;
  const auto algorithm = resamplingNamed(kernel.resampling);
  TERRANE_CHECK(
      algorithm && kernel.scaleX > 0.0 && kernel.scaleX <= 1.0 && kernel.scaleY > 0.0 && kernel.scaleY <= 1.0,
      "'{}', {} x {}", kernel.resampling, kernel.scaleX, kernel.scaleY);
  std::unique_ptr<Warper> warper(new Warper(raster));
  warper->transformer_ = createTransformer(raster, dataset, targetWkt);
  if (warper->transformer_ == nullptr) {
    return makeError("{}: cannot be brought into the dataset's CRS ({}); check --source-crs and --crs",
                     raster.path, messages.reason("no transformation"));
  }
  GDALSetGenImgProjTransformerDstGeoTransform(warper->transformer_, geoTransform.data());

  const std::unique_ptr<GDALWarpOptions, WarpOptionsDeleter> options(GDALCreateWarpOptions());
  options->hSrcDS = GDALDataset::ToHandle(&dataset);
  options->eResampleAlg = *algorithm;
  options->eWorkingDataType = GDT_Float32;
  options->pfnTransformer = GDALGenImgProjTransform;
  options->pTransformerArg = warper->transformer_;
  options->nBandCount = 1;
  options->panSrcBands = static_cast<int*>(CPLMalloc(sizeof(int)));
  options->panDstBands = static_cast<int*>(CPLMalloc(sizeof(int)));
  options->panSrcBands[0] = 1;
  options->panDstBands[0] = 1;
  options->nSrcAlphaBand = raster.alphaBand;

  // Void: what was declared, else NaN where the type can hold one. The destination's keeps GDAL on the path
  // with masks everywhere; the one without would round differently.
  GDALWarpInitDstNoDataReal(options.get(), kNaN);
  if (raster.noData) {
    GDALWarpInitSrcNoDataReal(options.get(), *raster.noData);
  } else if (!raster.integer && !raster.mask) {
    GDALWarpInitSrcNoDataReal(options.get(), kNaN);
  }

  // note: left to itself GDAL derives the kernel's width from the window at hand.
  char** list = nullptr;
  list = CSLSetNameValue(list, "XSCALE", fmt::format("{}", kernel.scaleX).c_str());
  list = CSLSetNameValue(list, "YSCALE", fmt::format("{}", kernel.scaleY).c_str());
  list = CSLSetNameValue(list, "INIT_DEST", "NO_DATA");
  list = CSLSetNameValue(list, "UNIFIED_SRC_NODATA", "YES");
  list = CSLSetNameValue(list, "SOURCE_EXTRA", sourceExtra(kernel).c_str());
  options->papszWarpOptions = list;
  if (warper->operation_.Initialize(options.get()) != CE_None) {
    return makeError("{}: cannot be warped ({})", raster.path, messages.reason("GDAL refuses"));
  }
  return warper;
}

Warper::~Warper() {
  if (transformer_ != nullptr) GDALDestroyGenImgProjTransformer(transformer_);
}

Status Warper::read(int col, int row, int cols, int rows, std::span<float> heights) {
  TERRANE_CHECK(heights.size() == static_cast<size_t>(cols) * static_cast<size_t>(rows), "{} heights",
                heights.size());
  const GdalMessages messages;
  std::fill(heights.begin(), heights.end(), kNaN);
  if (operation_.WarpRegionToBuffer(col, row, cols, rows, heights.data(), GDT_Float32) != CE_None) {
    return makeError(
        "{}: cannot be warped at column {}, row {} of its level ({}); the file may be damaged or cut short",
        raster_.path, col, row, messages.reason("read error"));
  }
  for (float& height : heights) {
    height = raster_.isVoid(height) ? kNaN : static_cast<float>(raster_.metersFromRaw(height));
  }
  return {};
}

}  // namespace terrane
