#include "terrane/bake/source.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <list>
#include <unordered_map>
#include <utility>

#include "input_crs.h"
#include "input_list.h"
#include "raster_source.h"
#include "terrane/dataset/hash.h"
#include "warp.h"

namespace terrane {
namespace {

constexpr size_t kOpenInputsPerReader = 48;  // file handles and block caches are not endless

// A rectangle of samples of one level; the end is one past the last.
struct SampleWindow {
  int64_t firstCol, firstRow, endCol, endRow;
  bool empty() const { return firstCol >= endCol || firstRow >= endRow; }
};

// The samples of a tile that an input may have.
SampleWindow commonWindow(TileId id, const PlacedInput& input) {
  const int64_t col = int64_t{id.col} * kTileCells;
  const int64_t row = int64_t{id.row} * kTileCells;
  return {std::max(col, input.firstCol), std::max(row, input.firstRow),
          std::min(col + kTileSamples, input.firstCol + input.cols),
          std::min(row + kTileSamples, input.firstRow + input.rows)};
}

class RasterReader final : public SourceReader {
 public:
  explicit RasterReader(std::shared_ptr<const PlacedSource> source) : source_(std::move(source)) {}

  Result<bool> readTile(TileId id, std::span<float> heights, std::span<uint16_t> ranks) override {
    TERRANE_CHECK(heights.size() == kTileSampleCount && ranks.size() == kTileSampleCount,
                  "{} heights, {} ranks", heights.size(), ranks.size());
    std::fill(heights.begin(), heights.end(), kNaN);
    std::fill(ranks.begin(), ranks.end(), uint16_t{0});

    // From the top down, until nothing below can be seen.
    int missing = kTileSampleCount;
    for (size_t i = source_->inputs.size(); i-- > 0 && missing > 0;) {
      const PlacedInput& input = source_->inputs[i];
      if (input.nativeLevel != id.level) continue;
      const SampleWindow window = commonWindow(id, input);
      if (window.empty()) continue;
      TERRANE_ASSIGN(OpenInput* const open, openInput(i));
      TERRANE_TRY(readWindow(input, *open, window));

      // Its samples go where nothing lies on top yet.
      const auto cols = static_cast<size_t>(window.endCol - window.firstCol);
      const auto rows = static_cast<size_t>(window.endRow - window.firstRow);
      const auto left = static_cast<size_t>(window.firstCol - int64_t{id.col} * kTileCells);
      const auto top = static_cast<size_t>(window.firstRow - int64_t{id.row} * kTileCells);
      for (size_t y = 0; y < rows; ++y) {
        for (size_t x = 0; x < cols; ++x) {
          const float height = window_[y * cols + x];
          const size_t at = (top + y) * kTileSamples + left + x;
          if (std::isnan(height) || ranks[at] != 0) continue;
          if (!(std::abs(height) < source_->largestHeight)) return tooHigh(input, height);
          heights[at] = height;
          ranks[at] = static_cast<uint16_t>(i + 1);
          --missing;
        }
      }
    }
    return missing < kTileSampleCount;
  }

 private:
  struct OpenInput {
    size_t index = 0;
    GdalDataset dataset;
    std::unique_ptr<Warper> warper;  // goes before its dataset
  };

  Error tooHigh(const PlacedInput& input, float height) const {
    return makeError(
        "{}: a height of {:g} m is beyond what steps of {:g} m can hold ({:g} m); give a larger --max-error, "
        "or --nodata with the value that means that there is no data{}",
        input.raster.path, height, source_->plan.heightStep, source_->largestHeight, rangeOf(input));
  }

  /// What the file itself holds: between its samples warping makes other values. Reads all of it.
  static std::string rangeOf(const PlacedInput& input) {
    const auto dataset = openRaster(input.raster.path);
    double range[2] = {};
    if (!dataset.ok() || (*dataset)->GetRasterBand(1)->ComputeRasterMinMax(0, range) != CE_None) return {};
    return fmt::format(" (the file's values go from {:.10g} to {:.10g})", range[0], range[1]);
  }

  // The input, opened now or before; the one not used for longest makes place.
  Result<OpenInput*> openInput(size_t index) {
    if (const auto found = byIndex_.find(index); found != byIndex_.end()) {
      open_.splice(open_.begin(), open_, found->second);
      return &open_.front();
    }
    if (open_.size() >= kOpenInputsPerReader) {
      byIndex_.erase(open_.back().index);
      open_.pop_back();
    }
    const PlacedInput& input = source_->inputs[index];
    OpenInput fresh;
    fresh.index = index;
    TERRANE_ASSIGN(fresh.dataset, openRaster(input.raster.path));
    if (fresh.dataset->GetRasterXSize() != input.raster.width ||
        fresh.dataset->GetRasterYSize() != input.raster.height) {
      return makeError("{}: changed while it was read; build again when it is at rest", input.raster.path);
    }
    if (input.warped) {
      TERRANE_ASSIGN(fresh.warper, Warper::open(input.raster, *fresh.dataset, source_->plan.crsWkt,
                                                source_->geoTransform(input.nativeLevel), input.kernel));
    }
    open_.push_front(std::move(fresh));
    byIndex_[index] = open_.begin();
    return &open_.front();
  }

  // Fills window_ with the input's heights.
  Status readWindow(const PlacedInput& input, OpenInput& open, const SampleWindow& window) {
    const auto cols = static_cast<int>(window.endCol - window.firstCol);
    const auto rows = static_cast<int>(window.endRow - window.firstRow);
    window_.resize(static_cast<size_t>(cols) * static_cast<size_t>(rows));
    if (input.warped)
      return open.warper->read(static_cast<int>(window.firstCol), static_cast<int>(window.firstRow), cols,
                               rows, window_);

    // Rasters that run against the lattice are read from their other end and turned.
    auto col = static_cast<int>(window.firstCol - input.firstCol);
    auto row = static_cast<int>(window.firstRow - input.firstRow);
    if (input.mirroredX) col = input.raster.width - col - cols;
    if (input.mirroredY) row = input.raster.height - row - rows;
    TERRANE_TRY(readHeights(*open.dataset, input.raster, col, row, cols, rows, window_, raw_, mask_));
    for (int y = 0; input.mirroredX && y < rows; ++y) {
      std::reverse(window_.begin() + ptrdiff_t{y} * cols, window_.begin() + ptrdiff_t{y + 1} * cols);
    }
    for (int y = 0; input.mirroredY && y < rows / 2; ++y) {
      std::swap_ranges(window_.begin() + ptrdiff_t{y} * cols, window_.begin() + ptrdiff_t{y + 1} * cols,
                       window_.begin() + ptrdiff_t{rows - 1 - y} * cols);
    }
    return {};
  }

  std::shared_ptr<const PlacedSource> source_;
  std::list<OpenInput> open_;  // last used first
  std::unordered_map<size_t, std::list<OpenInput>::iterator> byIndex_;
  std::vector<float> window_;
  std::vector<double> raw_;
  std::vector<uint8_t> mask_;
};

class RasterSource final : public Source {
 public:
  explicit RasterSource(PlacedSource source)
      : source_(std::make_shared<const PlacedSource>(std::move(source))) {
    for (const auto& input : source_->inputs) levels_.push_back(input.nativeLevel);
    levels_.push_back(source_->plan.frame.finestLevel);
    std::sort(levels_.begin(), levels_.end());
    levels_.erase(std::unique(levels_.begin(), levels_.end()), levels_.end());
  }

  const SourcePlan& plan() const override { return source_->plan; }
  std::vector<int> nativeLevels() const override { return levels_; }
  bool mayTouch(TileId id) const override {
    return std::any_of(source_->inputs.begin(), source_->inputs.end(), [&](const PlacedInput& input) {
      return input.nativeLevel == id.level && !commonWindow(id, input).empty();
    });
  }
  Result<std::unique_ptr<SourceReader>> openReader() const override {
    return std::unique_ptr<SourceReader>(std::make_unique<RasterReader>(source_));
  }

 private:
  std::shared_ptr<const PlacedSource> source_;
  std::vector<int> levels_;
};

// Looks at all inputs, side by side.
Result<std::vector<InputRaster>> describeInputs(const std::vector<InputPath>& paths,
                                                const SourceOptions& options, Progress& progress) {
  progress.beginStage("opening inputs", static_cast<int64_t>(paths.size()), "files");
  std::vector<InputRaster> rasters(paths.size());
  std::vector<std::string> errors(paths.size());
  tbb::parallel_for(size_t{0}, paths.size(), [&](size_t i) {
    auto raster = describeRaster(paths[i], options.noData);
    if (raster.ok())
      rasters[i] = std::move(raster).value();
    else
      errors[i] = raster.error().message;
    progress.advance(1);
  });
  for (const auto& error : errors) {
    if (!error.empty()) return Error{error};
  }

  // Pictures found in a folder lie over the terrain; they are not it.
  std::vector<InputRaster> kept;
  for (size_t i = 0; i < rasters.size(); ++i) {
    if (paths[i].fromFolder && rasters[i].imageLike) {
      progress.warn(fmt::format("{}: a picture, not heights; left out", rasters[i].path));
      continue;
    }
    kept.push_back(std::move(rasters[i]));
  }
  if (kept.empty())
    return makeError("{}: only pictures, no heights, among the inputs; name an elevation raster",
                     paths.front().path);

  // The same complaint about a thousand files is one line.
  constexpr size_t kWarningsShown = 5;
  size_t warnings = 0;
  for (const auto& raster : kept) {
    for (const auto& warning : raster.warnings) {
      if (++warnings <= kWarningsShown) progress.warn(warning);
    }
  }
  if (warnings > kWarningsShown)
    progress.warn(fmt::format("and {} more warnings about other inputs", warnings - kWarningsShown));
  return kept;
}

}  // namespace

Status hashInputs(PlacedSource& source, Progress& progress) {
  progress.beginStage("hashing inputs", static_cast<int64_t>(source.inputs.size()), "files");
  std::vector<std::string> errors(source.inputs.size());
  tbb::parallel_for(size_t{0}, source.inputs.size(), [&](size_t i) {
    const std::string file = fileBehind(source.inputs[i].raster.path);
    if (!file.empty() && source.inputs[i].raster.bytes > 0) {
      auto hash = sha256OfFile(file);
      if (hash.ok())
        source.plan.inputs[i].sha256 = std::move(hash).value();
      else
        errors[i] = hash.error().message;
    }
    progress.advance(1);
  });
  for (const auto& error : errors) {
    if (!error.empty()) return Error{error};
  }
  return {};
}

Result<std::vector<InputRaster>> describeRasters(const SourceOptions& options, Progress& progress) {
  TERRANE_ASSIGN(const std::vector<InputPath> paths, expandInputs(options.inputs));
  TERRANE_ASSIGN(std::vector<InputRaster> rasters, describeInputs(paths, options, progress));
  if (rasters.size() > kMaxInputs) {
    return makeError(
        "{} inputs are more than the {} that a dataset can have; join them with gdalbuildvrt first",
        rasters.size(), kMaxInputs);
  }

  // The user's word on CRSs, else every input must have one.
  if (!options.sourceCrs.empty()) {
    TERRANE_ASSIGN(const OGRSpatialReference given, crsFromUser(options.sourceCrs, "--source-crs"));
    for (auto& raster : rasters) raster.crs = given;
  }
  for (const auto& raster : rasters) {
    if (raster.crs.IsEmpty()) {
      return makeError(
          "{}: has no CRS; pass --source-crs, for example --source-crs EPSG:4326 if it is in degrees",
          raster.path);
    }
    if (!raster.crs.IsProjected() && !raster.crs.IsGeographic()) {
      return makeError(
          "{}: its CRS ({}) is neither projected nor geographic; pass --source-crs with the right one",
          raster.path, raster.crs.GetName());
    }
  }
  return rasters;
}

std::unique_ptr<Source> makeRasterSource(PlacedSource source) {
  return std::make_unique<RasterSource>(std::move(source));
}

Result<std::unique_ptr<Source>> openSource(const SourceOptions& options, Progress& progress) {
  TERRANE_ASSIGN(std::vector<InputRaster> rasters, describeRasters(options, progress));
  TERRANE_ASSIGN(PlacedSource source, placeInputs(std::move(rasters), options, progress));
  TERRANE_TRY(hashInputs(source, progress));
  return makeRasterSource(std::move(source));
}

}  // namespace terrane
