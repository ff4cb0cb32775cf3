#include "terrane/bake/compare.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <utility>

#include "compare_own_samples.h"
#include "compare_raster.h"
#include "input_crs.h"
#include "input_list.h"
#include "terrane/codec/all_layers.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/hash.h"
#include "workers.h"

namespace terrane {
namespace {

// Levels below a job's tile: 64 finest tiles a job, whose ancestors are decoded once.
constexpr int kJobLevels = 3;

// What the source says of one sample.
enum class Expected : uint8_t { Void, Height, Between };

struct Difference {
  uint64_t compared = 0;
  uint64_t onlyInSource = 0;
  uint64_t onlyInDataset = 0;
  uint64_t interpolated = 0;
  double largest = -1.0;
  double sum = 0.0;
  int64_t col = 0;  // of the largest, finest samples
  int64_t row = 0;

  // The larger wins, and of equals the north-westernmost, so that the order of work does not show.
  void note(double meters, int64_t atCol, int64_t atRow) {
    if (meters < largest) return;
    if (meters == largest && (row < atRow || (row == atRow && col <= atCol))) return;
    largest = meters;
    col = atCol;
    row = atRow;
  }
};

// One worker's readers, opened when they are first needed, and its scratch.
struct Worker {
  std::vector<std::unique_ptr<ComparedReader>> readers;
  std::vector<size_t> opened;  // oldest first
  std::vector<float> expected = std::vector<float>(kTileSampleCount);
  std::vector<Expected> kind = std::vector<Expected>(kTileSampleCount);
  std::vector<float> window;
};

class Comparison {
 public:
  Comparison(const Dataset& dataset, std::vector<ComparedRaster> rasters, const CompareOptions& options,
             Progress& progress)
      : dataset_(dataset),
        manifest_(dataset.manifest()),
        rasters_(std::move(rasters)),
        workers_(options.threads, options.cancel),
        progress_(progress) {}

  Result<ComparisonReport> run() {
    // A job is a tile some levels up; it decodes its chain of ancestors and all below it.
    const int finest = manifest_.frame.finestLevel;
    const int jobLevel = std::max(0, finest - kJobLevels);
    const int64_t jobCells = static_cast<int64_t>(kTileCells) << (finest - jobLevel);
    const int64_t cols = std::max<int64_t>(1, (manifest_.extentCols - 1 + jobCells - 1) / jobCells);
    const int64_t rows = std::max<int64_t>(1, (manifest_.extentRows - 1 + jobCells - 1) / jobCells);
    const int64_t tiles = ((manifest_.extentCols - 1 + kTileCells - 1) / kTileCells) *
                          ((manifest_.extentRows - 1 + kTileCells - 1) / kTileCells);
    progress_.beginStage("comparing", tiles, "tiles");
    std::vector<Worker> workers(static_cast<size_t>(workers_.count()));
    for (auto& worker : workers) worker.readers.resize(rasters_.size());
    std::vector<Difference> differences(static_cast<size_t>(cols * rows));
    TERRANE_TRY(workers_.forEach(cols * rows, [&](int worker, int64_t job) -> Status {
      const TileId id{jobLevel, static_cast<int32_t>(job % cols), static_cast<int32_t>(job / cols)};
      return compareJob(id, workers[static_cast<size_t>(worker)], differences[static_cast<size_t>(job)]);
    }));

    Difference total;
    for (const auto& part : differences) {
      total.compared += part.compared;
      total.onlyInSource += part.onlyInSource;
      total.onlyInDataset += part.onlyInDataset;
      total.interpolated += part.interpolated;
      total.sum += part.sum;
      if (part.compared > 0) total.note(part.largest, part.col, part.row);
    }
    const Frame& frame = manifest_.frame;
    return ComparisonReport{
        .compared = total.compared,
        .onlyInSource = total.onlyInSource,
        .onlyInDataset = total.onlyInDataset,
        .interpolated = total.interpolated,
        .largestMeters = std::max(0.0, total.largest),
        .meanMeters = total.compared > 0 ? total.sum / static_cast<double>(total.compared) : 0.0,
        .largestEasting = frame.originEasting + static_cast<double>(total.col) * frame.spacingX,
        .largestNorthing = frame.originNorthing - static_cast<double>(total.row) * frame.spacingY,
        .boundMeters = manifest_.maxErrorMeters,
    };
  }

 private:
  // Decodes or interpolates a tile; nothing where the dataset is void.
  Result<std::unique_ptr<Tile>> loadTile(TileId id, const Tile* parent) const {
    const ChildState state =
        parent == nullptr ? ChildState::Present : parent->children[static_cast<size_t>(id.quadrant())].state;
    if (state == ChildState::Void) return std::unique_ptr<Tile>();
    if (state == ChildState::Interpolated)
      return std::make_unique<Tile>(interpolateTile(*parent, id.quadrant()));
    TERRANE_ASSIGN(const auto payloads, dataset_.readAllLayers(id));
    if (!payloads)
      return makeError("{}: tile {} is missing; build the dataset again", dataset_.directory(), toString(id));
    auto tile = decodeAllLayers(*payloads, parent != nullptr ? &parent->samples : nullptr,
                                parent != nullptr ? id.quadrant() : 0, manifest_.scale);
    if (!tile.ok()) {
      return makeError("{}: tile {}: {}; build the dataset again", dataset_.directory(), toString(id),
                       tile.error().message);
    }
    return std::make_unique<Tile>(std::move(tile).value());
  }

  Status compareJob(TileId id, Worker& worker, Difference& difference) {
    std::unique_ptr<Tile> tile;
    for (int level = 0; level <= id.level && (level == 0 || tile); ++level) {
      TERRANE_ASSIGN(tile, loadTile(id.ancestor(level), tile.get()));
    }
    return compareBelow(id, tile.get(), worker, difference);
  }

  // Depth first; `tile` is null where the dataset is void.
  Status compareBelow(TileId id, const Tile* tile, Worker& worker, Difference& difference) {
    TERRANE_TRY(workers_.checkCancelled());
    const int below = manifest_.frame.finestLevel - id.level;
    const int64_t cells = static_cast<int64_t>(kTileCells) << below;
    if (id.col * cells >= std::max<int64_t>(1, manifest_.extentCols - 1) ||
        id.row * cells >= std::max<int64_t>(1, manifest_.extentRows - 1))
      return {};
    if (below == 0) return compareTile(id, tile, worker, difference);
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      std::unique_ptr<Tile> child;
      if (tile != nullptr) {
        TERRANE_ASSIGN(child, loadTile(id.child(quadrant), tile));
      }
      TERRANE_TRY(compareBelow(id.child(quadrant), child.get(), worker, difference));
    }
    return {};
  }

  Status compareTile(TileId id, const Tile* tile, Worker& worker, Difference& difference) {
    TERRANE_TRY(expectTile(id, worker));
    const int64_t firstCol = int64_t{id.col} * kTileCells;
    const int64_t firstRow = int64_t{id.row} * kTileCells;

    // Samples on a border count once, in the tile to their east and south; the last tiles own both borders.
    const int cols = static_cast<int>(
        std::min<int64_t>(firstCol + kTileCells >= manifest_.extentCols - 1 ? kTileSamples : kTileCells,
                          manifest_.extentCols - firstCol));
    const int rows = static_cast<int>(
        std::min<int64_t>(firstRow + kTileCells >= manifest_.extentRows - 1 ? kTileSamples : kTileCells,
                          manifest_.extentRows - firstRow));
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < cols; ++x) {
        const size_t at = static_cast<size_t>(y) * kTileSamples + static_cast<size_t>(x);
        const bool ground = tile != nullptr && tile->samples.states[at] != SampleState::Void;
        if (worker.kind[at] == Expected::Between) {
          ++difference.interpolated;
        } else if (worker.kind[at] == Expected::Void) {
          difference.onlyInDataset += ground ? 1 : 0;
        } else if (!ground) {
          ++difference.onlyInSource;
        } else {
          const double meters = std::abs(static_cast<double>(tile->samples.heights[at]) -
                                         static_cast<double>(worker.expected[at]));
          ++difference.compared;
          difference.sum += meters;
          difference.note(meters, firstCol + x, firstRow + y);
        }
      }
    }
    progress_.advance(1);
    return {};
  }

  // Lays the rasters on each other, from the top down, over a finest tile.
  Status expectTile(TileId id, Worker& worker) {
    std::fill(worker.kind.begin(), worker.kind.end(), Expected::Void);
    for (size_t i = rasters_.size(); i-- > 0;) {
      // The raster's samples around the tile, at its own level.
      const int coarser = manifest_.frame.finestLevel - rasters_[i].nativeLevel;
      const int64_t step = int64_t{1} << coarser;
      const int64_t firstCol = int64_t{id.col} * kTileCells;
      const int64_t firstRow = int64_t{id.row} * kTileCells;
      const int64_t col = firstCol >> coarser;
      const int64_t row = firstRow >> coarser;
      const int cols = static_cast<int>(((firstCol + kTileCells + step - 1) >> coarser) - col + 1);
      const int rows = static_cast<int>(((firstRow + kTileCells + step - 1) >> coarser) - row + 1);
      worker.window.resize(static_cast<size_t>(cols) * static_cast<size_t>(rows));
      TERRANE_ASSIGN(ComparedReader* const reader, readerFor(i, worker));
      TERRANE_TRY(reader->read(col, row, cols, rows, worker.window));

      // On its samples it tells the height; between them it only hides what lies below.
      const auto sample = [&](int64_t c, int64_t r) {
        return worker
            .window[static_cast<size_t>(r - row) * static_cast<size_t>(cols) + static_cast<size_t>(c - col)];
      };
      for (int y = 0; y < kTileSamples; ++y) {
        for (int x = 0; x < kTileSamples; ++x) {
          const size_t at = static_cast<size_t>(y) * kTileSamples + static_cast<size_t>(x);
          if (worker.kind[at] != Expected::Void) continue;
          const int64_t c = firstCol + x;
          const int64_t r = firstRow + y;
          const int64_t west = c >> coarser;
          const int64_t north = r >> coarser;
          const bool onCol = (c & (step - 1)) == 0;
          const bool onRow = (r & (step - 1)) == 0;
          if (onCol && onRow) {
            worker.expected[at] = sample(west, north);
            if (!std::isnan(worker.expected[at])) worker.kind[at] = Expected::Height;
            continue;
          }
          const int64_t east = onCol ? west : west + 1;
          const int64_t south = onRow ? north : north + 1;
          const bool any = !std::isnan(sample(west, north)) || !std::isnan(sample(east, north)) ||
                           !std::isnan(sample(west, south)) || !std::isnan(sample(east, south));
          if (any) worker.kind[at] = Expected::Between;
        }
      }
    }
    return {};
  }

  Result<ComparedReader*> readerFor(size_t index, Worker& worker) {
    constexpr size_t kMostOpen = 48;
    if (!worker.readers[index]) {
      if (worker.opened.size() >= kMostOpen) {
        worker.readers[worker.opened.front()].reset();
        worker.opened.erase(worker.opened.begin());
      }
      TERRANE_ASSIGN(worker.readers[index], ComparedReader::open(rasters_[index], manifest_));
      worker.opened.push_back(index);
    }
    return worker.readers[index].get();
  }

  const Dataset& dataset_;
  const Manifest& manifest_;
  std::vector<ComparedRaster> rasters_;
  Workers workers_;
  Progress& progress_;
};

// The value that the manifest recorded as void: "-9999", "nan"; nothing for "".
std::optional<double> recordedNoData(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return end != text.c_str() ? std::optional<double>(value) : std::nullopt;
}

// The manifest's record of a raster, or null.
const InputRecord* findRecord(const Manifest& manifest, const InputPath& path, size_t position,
                              size_t count) {
  const std::string name = path.path.substr(path.path.find_last_of('/') + 1);
  const auto hash = sha256OfFile(path.path);
  for (const auto& record : manifest.inputs) {
    if (hash.ok() && !record.sha256.empty() && record.sha256 == *hash) return &record;
  }
  for (const auto& record : manifest.inputs) {
    if (record.name == name) return &record;
  }
  return count == manifest.inputs.size() ? &manifest.inputs[position] : nullptr;
}

}  // namespace

Result<ComparisonReport> compareWithSource(const Dataset& dataset, const std::vector<std::string>& rasters,
                                           const CompareOptions& options, Progress& progress) {
  const Manifest& manifest = dataset.manifest();
  TERRANE_ASSIGN(const std::vector<InputPath> paths, expandInputs(rasters));
  progress.beginStage("opening rasters", static_cast<int64_t>(paths.size()), "files");
  std::vector<ComparedRaster> compared;
  for (size_t i = 0; i < paths.size(); ++i) {
    progress.advance(1);
    const InputRecord* record = findRecord(manifest, paths[i], i, paths.size());
    if (record == nullptr && paths[i].fromFolder) {
      progress.warn(fmt::format("{}: not among the dataset's inputs; left out", paths[i].path));
      continue;
    }
    if (record == nullptr) {
      return makeError("{}: not among the inputs that the dataset was built from ('terrane info' lists them)",
                       paths[i].path);
    }

    // The raster as the build took it: void and CRS as the manifest says, unless the user says otherwise.
    auto noData = options.noData;
    const bool masked = record->noData.find("mask") != std::string::npos;
    if (!noData && !masked) noData = recordedNoData(record->noData);
    TERRANE_ASSIGN(InputRaster raster, describeRaster(paths[i], noData));
    if (!options.noData && record->noData.empty()) raster.noData.reset();
    const std::string& crs = options.sourceCrs.empty() ? record->sourceCrs : options.sourceCrs;
    if (!crs.empty()) {
      TERRANE_ASSIGN(raster.crs, crsFromUser(crs, options.sourceCrs.empty() ? "the manifest's sourceCrs"
                                                                            : "--source-crs"));
    }
    compared.push_back({std::move(raster), record->warped, record->nativeLevel, record->resampling});
  }
  if (compared.size() != manifest.inputs.size()) {
    progress.warn(fmt::format(
        "{} rasters given, the dataset was built from {}: samples of the others count as differences",
        compared.size(), manifest.inputs.size()));
  }
  const bool isWarped =
      std::any_of(compared.begin(), compared.end(), [](const auto& input) { return input.warped; });
  const bool isAlone = isWarped && compared.size() == 1 && manifest.inputs.size() == 1;
  const std::optional<InputRaster> alone =
      isAlone ? std::optional<InputRaster>(compared.front().raster) : std::nullopt;
  TERRANE_ASSIGN(ComparisonReport report, Comparison(dataset, std::move(compared), options, progress).run());
  report.isWarped = isWarped;
  // note: what is placed by ground control points has no places of its own.
  if (alone && alone->hasGeoTransform) {
    TERRANE_ASSIGN(report.ownSamples, compareOwnSamples(dataset, *alone, options.cancel, progress));
  }
  return report;
}

}  // namespace terrane
