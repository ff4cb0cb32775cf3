#include "terrane/bake/synth.h"

#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <unistd.h>

#include "input_gdal.h"
#include "synth_cover.h"
#include "synth_ground.h"
#include "synth_world.h"

namespace terrane {
namespace {

namespace fs = std::filesystem;
using synth::Ground;
using synth::GroundTile;
using synth::Water;

constexpr int kBlock = 512;  ///< samples a side of a block of the files
constexpr double kCentreEast = 500000.0;
constexpr double kCentreNorth = 6700000.0;
constexpr int kEpsg = 32632;

Status checkOptions(const SynthOptions& options) {
  if (options.output.empty()) return makeError("no output; pass -o FILE.tif");
  if (options.cols < 2 || options.rows < 2 || options.cols > kSynthMaxSide || options.rows > kSynthMaxSide) {
    return makeError("size {}x{} is out of range; each side takes 2 to {} samples", options.cols,
                     options.rows, kSynthMaxSide);
  }
  // note: written so that NaN fails too.
  if (!(options.spacingMeters >= 0.5 && options.spacingMeters <= 1000.0)) {
    return makeError("spacing {} m is out of range; pass 0.5 to 1000", options.spacingMeters);
  }
  if (options.threads < 0)
    return makeError("{} threads make no sense; pass 0 for all cores", options.threads);
  return {};
}

/// A GeoTIFF that is written beside its place; it goes there by `commit`, and vanishes without.
class RasterFile {
 public:
  static Result<std::unique_ptr<RasterFile>> create(const std::string& path, const SynthOptions& options,
                                                    int bands, GDALDataType type) {
    std::error_code code;
    if (fs::is_directory(path, code)) return makeError("{}: is a folder; name a file", path);
    if (fs::exists(path, code) && !options.overwrite) {
      return makeError("{}: exists; pass --overwrite to replace it, or another -o", path);
    }
    const fs::path folder = fs::path(path).parent_path();
    if (!folder.empty() && !fs::is_directory(folder, code)) {
      return makeError("{}: the folder {} does not exist; make it first", path, folder.string());
    }
    auto file = std::make_unique<RasterFile>();
    file->path_ = path;
    file->partPath_ = fmt::format("{}.part{}", path, ::getpid());
    file->type_ = type;
    GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
    if (driver == nullptr) return makeError("this GDAL has no GeoTIFF driver; install one that has");
    const auto set = [](CPLStringList& list, const char* name, const std::string& value) {
      list.SetNameValue(name, value.c_str());
    };
    CPLStringList creation;
    set(creation, "TILED", "YES");
    set(creation, "BLOCKXSIZE", std::to_string(kBlock));
    set(creation, "BLOCKYSIZE", std::to_string(kBlock));
    set(creation, "COMPRESS", "DEFLATE");
    set(creation, "ZLEVEL", "4");
    set(creation, "PREDICTOR", type == GDT_Float32 ? "3" : "2");
    set(creation, "BIGTIFF", "IF_SAFER");
    set(creation, "INTERLEAVE", "BAND");
    if (bands == 3) set(creation, "PHOTOMETRIC", "RGB");
    if (options.threads != 1) {
      set(creation, "NUM_THREADS", options.threads == 0 ? "ALL_CPUS" : std::to_string(options.threads));
    }
    const GdalMessages messages;
    file->dataset_.reset(driver->Create(file->partPath_.c_str(), static_cast<int>(options.cols),
                                        static_cast<int>(options.rows), bands, type, creation.List()));
    if (!file->dataset_) {
      return makeError("{}: cannot be created ({}); check the folder's permissions and free space", path,
                       messages.reason("no reason given"));
    }
    const double west = kCentreEast - (static_cast<double>(options.cols / 2) + 0.5) * options.spacingMeters;
    const double north = kCentreNorth + (static_cast<double>(options.rows / 2) + 0.5) * options.spacingMeters;
    double transform[6] = {west, options.spacingMeters, 0.0, north, 0.0, -options.spacingMeters};
    OGRSpatialReference crs;
    if (crs.importFromEPSG(kEpsg) != OGRERR_NONE || file->dataset_->SetSpatialRef(&crs) != CE_None ||
        file->dataset_->SetGeoTransform(transform) != CE_None) {
      return makeError("{}: its place on the map cannot be written ({}); is PROJ's database installed?", path,
                       messages.reason("no reason given"));
    }
    if (bands == 1) file->dataset_->GetRasterBand(1)->SetUnitType("m");
    return file;
  }

  ~RasterFile() {
    const GdalMessages messages;
    dataset_.reset();
    std::error_code code;
    if (!partPath_.empty()) fs::remove(partPath_, code);
  }

  /// Writes a whole block, kBlock squared values of the file's type.
  Status writeBlock(int band, int blockCol, int blockRow, void* values) {
    const GdalMessages messages;
    const CPLErr outcome = dataset_->GetRasterBand(band)->WriteBlock(blockCol, blockRow, values);
    if (outcome != CE_None || !messages.errors().empty()) return writeError(messages);
    return {};
  }

  /// Finishes the file and checks that its last block reads back; then it only waits for `moveIntoPlace`.
  Status finish() {
    const GdalMessages messages;
    const int cols = dataset_->GetRasterXSize();
    const int rows = dataset_->GetRasterYSize();
    dataset_.reset();
    if (!messages.errors().empty()) return writeError(messages);
    GdalDataset again(GDALDataset::Open(partPath_.c_str(), GDAL_OF_RASTER));
    std::vector<double> values(1);
    if (!again || again->GetRasterBand(again->GetRasterCount())
                          ->RasterIO(GF_Read, cols - 1, rows - 1, 1, 1, values.data(), 1, 1, GDT_Float64, 0,
                                     0, nullptr) != CE_None) {
      return writeError(messages);
    }
    return {};
  }

  /// Renames the finished file to its name; gives its size.
  Result<uint64_t> moveIntoPlace() {
    std::error_code code;
    const uint64_t bytes = fs::file_size(partPath_, code);
    if (!code) fs::rename(partPath_, path_, code);
    if (code)
      return makeError("{}: cannot be put in place ({}); check the folder's permissions", path_,
                       code.message());
    partPath_.clear();
    return bytes;
  }

 private:
  Error writeError(const GdalMessages& messages) const {
    return makeError("{}: cannot be written ({}); is the disk full?", path_,
                     messages.reason("no reason given"));
  }

  std::string path_;
  std::string partPath_;
  GDALDataType type_ = GDT_Float32;
  GdalDataset dataset_;
};

/// A block on its way from the ground to the files.
struct Block {
  int col = 0;
  int row = 0;
  int cols = 0;  ///< samples within the raster
  int rows = 0;
  std::vector<float> heights;    ///< kBlock squared, edge samples repeated beyond the raster
  std::vector<int16_t> rounded;  ///< instead, for SynthType::kInt16
  std::vector<uint8_t> colors[3];
  float minHeight = 0.0f;
  float maxHeight = 0.0f;
  int64_t wet = 0;
};

/// Spreads cols x rows values to a whole block, the last column and row repeated.
template <class To, class Value>
void padBlock(int cols, int rows, std::vector<To>& out, Value value) {
  out.resize(static_cast<size_t>(kBlock) * kBlock);
  for (int row = 0; row < kBlock; ++row) {
    for (int col = 0; col < kBlock; ++col) {
      out[static_cast<size_t>(row) * kBlock + static_cast<size_t>(col)] =
          value(std::min(col, cols - 1), std::min(row, rows - 1));
    }
  }
}

std::shared_ptr<Block> makeBlock(const Ground& ground, const SynthOptions& options, int blockCol,
                                 int blockRow) {
  auto block = std::make_shared<Block>();
  block->col = blockCol;
  block->row = blockRow;
  const int64_t col0 = static_cast<int64_t>(blockCol) * kBlock;
  const int64_t row0 = static_cast<int64_t>(blockRow) * kBlock;
  const int cols = static_cast<int>(std::min<int64_t>(kBlock, options.cols - col0));
  const int rows = static_cast<int>(std::min<int64_t>(kBlock, options.rows - row0));
  block->cols = cols;
  block->rows = rows;

  // Colours look one sample further, for the slope.
  const bool colored = !options.colorOutput.empty();
  const int border = colored ? 1 : 0;
  const int64_t groundCol = col0 - options.cols / 2;
  const int64_t groundRow = row0 - options.rows / 2;
  GroundTile tile;
  ground.evaluate(groundCol - border, groundRow - border, cols + 2 * border, rows + 2 * border, tile);
  const auto index = [&](int col, int row) {
    return static_cast<size_t>(row + border) * static_cast<size_t>(tile.cols) +
           static_cast<size_t>(col + border);
  };
  block->minHeight = block->maxHeight = tile.height[index(0, 0)];
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      const float height = tile.height[index(col, row)];
      block->minHeight = std::min(block->minHeight, height);
      block->maxHeight = std::max(block->maxHeight, height);
      if (tile.water[index(col, row)] != Water::kNone) ++block->wet;
    }
  }
  if (options.type == SynthType::kFloat32) {
    padBlock(cols, rows, block->heights, [&](int col, int row) { return tile.height[index(col, row)]; });
  } else {
    padBlock(cols, rows, block->rounded, [&](int col, int row) {
      return static_cast<int16_t>(std::floor(tile.height[index(col, row)] + 0.5f));
    });
  }
  if (colored) {
    std::vector<uint8_t> channels[3];
    synth::colorGround(ground, groundCol, groundRow, cols, rows, tile, channels[0], channels[1], channels[2]);
    for (int k = 0; k < 3; ++k) {
      padBlock(cols, rows, block->colors[k], [&](int col, int row) {
        return channels[k][static_cast<size_t>(row) * static_cast<size_t>(cols) + static_cast<size_t>(col)];
      });
    }
  }
  return block;
}

}  // namespace

Result<SynthReport> synthesize(const SynthOptions& options, Progress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  TERRANE_TRY(checkOptions(options));
  const bool colored = !options.colorOutput.empty();
  if (colored &&
      fs::path(options.output).lexically_normal() == fs::path(options.colorOutput).lexically_normal()) {
    return makeError("{}: heights and colours cannot share a file; pass another --color", options.output);
  }
  registerGdal();
  TERRANE_ASSIGN(const std::unique_ptr<RasterFile> heights,
                 RasterFile::create(options.output, options, 1,
                                    options.type == SynthType::kFloat32 ? GDT_Float32 : GDT_Int16));
  std::unique_ptr<RasterFile> colors;
  if (colored) {
    TERRANE_ASSIGN(colors, RasterFile::create(options.colorOutput, options, 3, GDT_Byte));
  }

  progress.beginStage("world", 1, "worlds");
  if (options.cancel != nullptr && *options.cancel) return makeError("interrupted; nothing was written");
  const std::shared_ptr<const synth::World> world = synth::shareWorld(options.seed);
  const Ground ground(*world, options.spacingMeters);
  progress.advance(1);

  // Blocks are made side by side and written in the order of the file, so that the bytes never depend on
  // the threads.
  const int blockCols = static_cast<int>((options.cols + kBlock - 1) / kBlock);
  const int blockRows = static_cast<int>((options.rows + kBlock - 1) / kBlock);
  const int64_t blocks = static_cast<int64_t>(blockCols) * blockRows;
  progress.beginStage("ground", options.cols * options.rows, "samples");
  SynthReport report;
  report.cols = options.cols;
  report.rows = options.rows;
  report.minMeters = 1.0e9;
  report.maxMeters = -1.0e9;
  int64_t wet = 0;
  int64_t next = 0;
  std::optional<Error> error;
  std::atomic<bool> stop = false;
  tbb::task_arena arena(options.threads == 0 ? tbb::task_arena::automatic : options.threads);
  arena.execute([&] {
    const size_t tokens = 3 * static_cast<size_t>(std::max(1, arena.max_concurrency()));
    tbb::parallel_pipeline(
        tokens,
        tbb::make_filter<void, int64_t>(tbb::filter_mode::serial_in_order,
                                        [&](tbb::flow_control& control) -> int64_t {
                                          if (next >= blocks || stop) {
                                            control.stop();
                                            return 0;
                                          }
                                          return next++;
                                        }) &
            tbb::make_filter<int64_t, std::shared_ptr<Block>>(
                tbb::filter_mode::parallel,
                [&](int64_t index) {
                  return makeBlock(ground, options, static_cast<int>(index % blockCols),
                                   static_cast<int>(index / blockCols));
                }) &
            tbb::make_filter<std::shared_ptr<Block>, void>(
                tbb::filter_mode::serial_in_order, [&](const std::shared_ptr<Block>& block) {
                  if (error) return;
                  void* values = options.type == SynthType::kFloat32
                                     ? static_cast<void*>(block->heights.data())
                                     : static_cast<void*>(block->rounded.data());
                  Status status = heights->writeBlock(1, block->col, block->row, values);
                  for (int k = 0; colored && status.ok() && k < 3; ++k) {
                    status = colors->writeBlock(k + 1, block->col, block->row, block->colors[k].data());
                  }
                  if (status.ok() && options.cancel != nullptr && *options.cancel) {
                    status = makeError("interrupted; nothing was written");
                  }
                  if (!status.ok()) {
                    error = status.error();
                    stop = true;
                    return;
                  }
                  report.minMeters = std::min(report.minMeters, static_cast<double>(block->minHeight));
                  report.maxMeters = std::max(report.maxMeters, static_cast<double>(block->maxHeight));
                  wet += block->wet;
                  progress.advance(static_cast<int64_t>(block->cols) * block->rows);
                }));
  });
  if (error) return *error;

  TERRANE_TRY(heights->finish());
  if (colored) TERRANE_TRY(colors->finish());
  TERRANE_ASSIGN(report.bytes, heights->moveIntoPlace());
  if (colored) {
    TERRANE_ASSIGN(report.colorBytes, colors->moveIntoPlace());
  }
  report.waterShare =
      static_cast<double>(wet) / (static_cast<double>(options.cols) * static_cast<double>(options.rows));
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace terrane
