#include "compare_raster.h"

#include <cpl_string.h>
#include <gdal_utils.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "input_crs.h"
#include "warp.h"

namespace terrane {
namespace {

struct TranslateOptionsDeleter {
  void operator()(GDALTranslateOptions* options) const { GDALTranslateOptionsFree(options); }
};
struct WarpAppOptionsDeleter {
  void operator()(GDALWarpAppOptions* options) const { GDALWarpAppOptionsFree(options); }
};

// Places in pixels of a run of samples along one axis; -1 for those beside the raster. `first` and `step` are
// CRS coordinates, `edge` and `pixel` the raster's transform.
void pixelPlaces(int64_t start, int count, double first, double step, double edge, double pixel, int size,
                 std::vector<int>& places) {
  places.resize(static_cast<size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double at = first + static_cast<double>(start + i) * step;
    const double place = std::round((at - edge) / pixel - 0.5);
    places[static_cast<size_t>(i)] = place >= 0.0 && place < size ? static_cast<int>(place) : -1;
  }
}

// The part of a raster's axis that these places use: first and one past the last; empty where none is used.
std::pair<int, int> usedRange(const std::vector<int>& places) {
  int first = std::numeric_limits<int>::max();
  int last = -1;
  for (const int place : places) {
    if (place < 0) continue;
    first = std::min(first, place);
    last = std::max(last, place);
  }
  return {first, last + 1};
}

}  // namespace

ComparedReader::~ComparedReader() {
  // note: a view closes before what it looks at.
  warped_.reset();
  oneBand_.reset();
  file_.reset();
}

Result<std::unique_ptr<ComparedReader>> ComparedReader::open(const ComparedRaster& compared,
                                                             const Manifest& manifest) {
  std::unique_ptr<ComparedReader> reader(new ComparedReader(compared, manifest));
  const int coarser = manifest.frame.finestLevel - compared.nativeLevel;
  reader->spacingX_ = std::ldexp(manifest.frame.spacingX, coarser);
  reader->spacingY_ = std::ldexp(manifest.frame.spacingY, coarser);
  TERRANE_ASSIGN(reader->file_, openRaster(compared.raster.path));
  if (compared.warped) TERRANE_TRY(reader->openWarped());
  return reader;
}

Status ComparedReader::openWarped() {
  const InputRaster& raster = compared_.raster;
  const GdalMessages messages;
  const auto fail = [&] {
    return makeError(
        "{}: cannot be warped onto the dataset's grid ({}); is it the raster that the dataset was built "
        "from?",
        raster.path, messages.reason("GDAL refuses"));
  };

  // GDALWarp() takes all bands: leave the first, and the alpha behind its mask.
  GDALDatasetH source = GDALDataset::ToHandle(file_.get());
  int usage = 0;
  if (file_->GetRasterCount() > (raster.alphaBand != 0 ? 2 : 1)) {
    CPLStringList arguments;
    for (const char* argument : {"-of", "VRT", "-b", "1"}) arguments.AddString(argument);
    if (raster.alphaBand != 0) {
      arguments.AddString("-b");
      arguments.AddString(std::to_string(raster.alphaBand).c_str());
    }
    const std::unique_ptr<GDALTranslateOptions, TranslateOptionsDeleter> options(
        GDALTranslateOptionsNew(arguments.List(), nullptr));
    oneBand_.reset(GDALDataset::FromHandle(GDALTranslate("", source, options.get(), &usage)));
    if (!oneBand_) return fail();
    source = GDALDataset::ToHandle(oneBand_.get());
  }

  // The level's lattice as a raster, pixels around samples.
  const int coarser = manifest_.frame.finestLevel - compared_.nativeLevel;
  const int64_t cols = ((manifest_.extentCols - 1) >> coarser) + 2;
  const int64_t rows = ((manifest_.extentRows - 1) >> coarser) + 2;
  const double west = manifest_.frame.originEasting - 0.5 * spacingX_;
  const double north = manifest_.frame.originNorthing + 0.5 * spacingY_;
  const auto number = [](double value) { return fmt::format("{:.17g}", value); };
  CPLStringList arguments;
  const auto add = [&](std::initializer_list<std::string> words) {
    for (const auto& word : words) arguments.AddString(word.c_str());
  };
  TERRANE_ASSIGN(const WarpPlan plan, planWarp(raster, *file_, manifest_.crsWkt));
  const WarpKernel kernel = planKernel(compared_.resampling, plan, raster, spacingX_, spacingY_);
  add({"-of", "VRT", "-r", kernel.resampling, "-et", "0", "-ot", "Float32", "-wt", "Float32", "-ovr", "NONE",
       "-novshift"});
  add({"-s_srs", crsWkt(raster.crs), "-t_srs", manifest_.crsWkt, "-dstnodata", "nan"});
  add({"-te", number(west), number(north - static_cast<double>(rows) * spacingY_),
       number(west + static_cast<double>(cols) * spacingX_), number(north)});
  add({"-ts", std::to_string(cols), std::to_string(rows)});
  add({"-wo", fmt::format("XSCALE={}", kernel.scaleX), "-wo", fmt::format("YSCALE={}", kernel.scaleY), "-wo",
       "SOURCE_EXTRA=" + sourceExtra(kernel)});
  if (raster.noData)
    add({"-srcnodata", number(*raster.noData)});
  else
    add({"-srcnodata", !raster.integer && !raster.mask ? "nan" : "None"});
  const std::unique_ptr<GDALWarpAppOptions, WarpAppOptionsDeleter> options(
      GDALWarpAppOptionsNew(arguments.List(), nullptr));
  if (!options) return fail();
  warped_.reset(GDALDataset::FromHandle(GDALWarp("", nullptr, 1, &source, options.get(), &usage)));
  if (!warped_) return fail();
  return {};
}

Status ComparedReader::read(int64_t col, int64_t row, int cols, int rows, std::span<float> heights) {
  const InputRaster& raster = compared_.raster;
  std::fill(heights.begin(), heights.end(), kNaN);

  // Where in the raster, or in its warped view, the samples stand.
  const Frame& frame = manifest_.frame;
  GDALDataset& from = warped_ ? *warped_ : *file_;
  if (warped_) {
    pixelPlaces(col, cols, 0.0, 1.0, -0.5, 1.0, from.GetRasterXSize(), pixelCols_);
    pixelPlaces(row, rows, 0.0, 1.0, -0.5, 1.0, from.GetRasterYSize(), pixelRows_);
  } else {
    const auto& g = raster.geoTransform;
    pixelPlaces(col, cols, frame.originEasting, spacingX_, g[0], g[1], raster.width, pixelCols_);
    pixelPlaces(row, rows, frame.originNorthing, -spacingY_, g[3], g[5], raster.height, pixelRows_);
  }
  const auto [left, right] = usedRange(pixelCols_);
  const auto [top, bottom] = usedRange(pixelRows_);
  if (left >= right || top >= bottom) return {};

  // One read of them all; what GDAL complains about is never taken for data.
  const int width = right - left;
  const int height = bottom - top;
  const size_t count = static_cast<size_t>(width) * static_cast<size_t>(height);
  const GdalMessages messages;
  raw_.resize(count);
  GDALRasterBand& band = *from.GetRasterBand(1);
  bool good = band.RasterIO(GF_Read, left, top, width, height, raw_.data(), width, height, GDT_Float64, 0, 0,
                            nullptr) == CE_None;
  const bool masked = raster.mask && !warped_;
  if (good && masked) {
    mask_.resize(count);
    good = band.GetMaskBand()->RasterIO(GF_Read, left, top, width, height, mask_.data(), width, height,
                                        GDT_Byte, 0, 0, nullptr) == CE_None;
  }
  if (!good || !messages.errors().empty()) {
    return makeError("{}: cannot be read ({}); the file seems damaged or cut short, copy it again",
                     raster.path, messages.reason("read error"));
  }

  // Raw values become metres where they mean ground.
  for (int y = 0; y < rows; ++y) {
    const int pixelRow = pixelRows_[static_cast<size_t>(y)];
    if (pixelRow < 0) continue;
    for (int x = 0; x < cols; ++x) {
      const int pixelCol = pixelCols_[static_cast<size_t>(x)];
      if (pixelCol < 0) continue;
      const size_t at = static_cast<size_t>(pixelRow - top) * static_cast<size_t>(width) +
                        static_cast<size_t>(pixelCol - left);
      if (raster.isVoid(raw_[at]) || (masked && mask_[at] == 0)) continue;
      heights[static_cast<size_t>(y) * static_cast<size_t>(cols) + static_cast<size_t>(x)] =
          static_cast<float>(raster.metersFromRaw(raw_[at]));
    }
  }
  return {};
}

}  // namespace terrane
