#include "terrane/bake/build.h"

#include <gdal.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <optional>

#include "build_output.h"
#include "imagery_build.h"
#include "node_measure.h"
#include "pyramid_steps.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/dataset.h"
#include "terrane/dataset/hash.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {

namespace {

constexpr const char* kArchiveName = "elevation.pmtiles";

/// Height of ground, lowest and highest, over all stored tiles.
struct HeightRange {
  double low = 0.0;
  double high = 0.0;
};

/// Codes that tell small errors apart and never run out.
void chooseCodeUnits(const HeightRange& range, double maxErrorMeters, int finestLevel,
                     ElevationScale& scale) {
  // The largest error, and one code more for each bintree level above it, must stay below 255.
  const double largest = std::max(2.0 * (range.high - range.low), scale.heightStep) + 2.0 * maxErrorMeters;
  const double codesLeft = 254.0 - 2.0 * (finestLevel + 8);
  scale.errorUnit = std::max(scale.heightStep / 64.0, largest / std::exp2(codesLeft / 8.0));
  // Ranges a little wider than the ground's, so that rounding cannot push a height out.
  const double slack = 1e-6 * (1.0 + std::abs(range.low) + std::abs(range.high));
  scale.rangeBase = range.low - maxErrorMeters - slack;
  // 2047 of the 65535 codes, and none finer than the heights' own step: a height range need not be finer, and
  // its lowest bits would cost bytes.
  scale.rangeUnit =
      std::max(scale.heightStep, (range.high - range.low + 2.0 * (maxErrorMeters + slack)) / 2047.0);
}

/// Turns tiles into payloads, each worker with a parent at hand.
class TileEncoder {
 public:
  TileEncoder(const Pyramid& pyramid, const NodeStores& stores, const ElevationScale& scale, int workers)
      : pyramid_(pyramid), stores_(stores), scale_(scale), scratches_(static_cast<size_t>(workers)) {}

  Result<std::vector<uint8_t>> encode(int worker, TileId id) {
    Scratch& scratch = scratches_[static_cast<size_t>(worker)];
    const int index = pyramid_.find(id);
    const PyramidTile& tile = pyramid_.levels[static_cast<size_t>(id.level)][static_cast<size_t>(index)];
    Tile& out = scratch.tile;
    TERRANE_TRY(pyramid_.readSamples(tile, out.samples));
    TERRANE_TRY(takeNodes(tile, scratch.codes, out.nodes));
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      out.children[static_cast<size_t>(quadrant)] = summariseChild(tile, out, quadrant);
    }
    if (id.isRoot()) return encodeTile(out, nullptr, 0, scale_);

    // Siblings follow each other, so that one parent often serves for four.
    if (scratch.parentId != id.parent()) {
      const int parent = pyramid_.find(id.parent());
      TERRANE_TRY(pyramid_.readSamples(
          pyramid_.levels[static_cast<size_t>(id.level) - 1][static_cast<size_t>(parent)], scratch.parent));
      scratch.parentId = id.parent();
    }
    return encodeTile(out, &scratch.parent, id.quadrant(), scale_);
  }

 private:
  struct Scratch {
    Tile tile;
    TileSamples parent;
    TileId parentId{-1, 0, 0};
    TileCodes codes;
  };

  Status takeNodes(const PyramidTile& tile, TileCodes& codes, TileNodes& out) const {
    TERRANE_TRY(stores_.joined.readValue(static_cast<uint64_t>(tile.block), codes));
    const int count = tileNodeCount(tile.id.isRoot());
    out.error.assign(codes.error.begin(), codes.error.begin() + count);
    out.largeError.assign(codes.large.begin(), codes.large.begin() + tileLargeNodeCount(tile.id.isRoot()));
    out.low.assign(codes.low.begin(), codes.low.begin() + count);
    out.high.assign(codes.high.begin(), codes.high.begin() + count);
    return {};
  }

  ChildSummary summariseChild(const PyramidTile& tile, const Tile& out, int quadrant) const {
    const int32_t child = tile.children[static_cast<size_t>(quadrant)];
    const auto below = static_cast<size_t>(tile.id.level) + 1;
    if (child < 0 || !pyramid_.levels[below][static_cast<size_t>(child)].stored)
      return summariseMissingChild(out.samples, out.nodes, tile.id.isRoot(), quadrant);
    return pyramid_.levels[below][static_cast<size_t>(child)].nodes;
  }

  const Pyramid& pyramid_;
  const NodeStores& stores_;
  const ElevationScale& scale_;
  std::vector<Scratch> scratches_;
};

/// All stored tiles in the archive's order.
std::vector<TileId> storedTiles(const Pyramid& pyramid) {
  std::vector<std::pair<uint64_t, TileId>> order;
  for (const auto& level : pyramid.levels) {
    for (const PyramidTile& tile : level) {
      if (tile.stored) order.emplace_back(pmtilesId(tile.id), tile.id);
    }
  }
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<TileId> out;
  for (const auto& [id, tile] : order) out.push_back(tile);
  return out;
}

Status writeArchive(const std::string& path, const Pyramid& pyramid, const NodeStores& stores,
                    const ElevationScale& scale, const std::vector<TileId>& tiles, Jobs& jobs,
                    Progress& progress) {
  progress.beginStage("encoding", static_cast<int64_t>(tiles.size()), "tiles");
  std::optional<PmtilesWriter> writer;
  TileEncoder encoder(pyramid, stores, scale, jobs.workers().count());
  const Status done = jobs.runInOrder<PmtilesPlace>(
      "encoding", static_cast<int64_t>(tiles.size()), &progress,
      [&](std::span<const PmtilesPlace> before) -> Status {
        TERRANE_ASSIGN(writer, PmtilesWriter::goOn(path, before));
        return {};
      },
      [&](int worker, int64_t i) { return encoder.encode(worker, tiles[static_cast<size_t>(i)]); },
      [&](int64_t i, const std::vector<uint8_t>& bytes) {
        return writer->add(tiles[static_cast<size_t>(i)], bytes);
      });
  TERRANE_TRY(done);
  return writer->finish(R"({"name":"elevation","format":"terrane elevation payload 2"})");
}

/// The SHA-256 of a finished file.
Result<std::string> hashOnce(const std::string& path, const std::string& stage, Jobs& jobs) {
  using Digits = std::array<char, 64>;
  const auto hashes = jobs.run<Digits>(stage, 1, nullptr, [&](int, int64_t) -> Result<Digits> {
    TERRANE_ASSIGN(const std::string hash, sha256OfFile(path));
    Digits digits;
    TERRANE_CHECK(hash.size() == digits.size(), "{}", hash);
    std::copy(hash.begin(), hash.end(), digits.begin());
    return digits;
  });
  if (!hashes.ok()) return hashes.error();
  return std::string(hashes->front().begin(), hashes->front().end());
}

/// All that shapes the result, as text. A work folder with another plan is of no use.
std::string describePlan(const SourcePlan& plan, const ImageryPlan& imagery, const BuildOptions& options,
                         const std::string& name) {
  std::string text = fmt::format(
      "terrane {} work 1 dataset {} payload 2\nname {}\noptions {}\nattribution {}\ncrs {}\norigin {:.17g} "
      "{:.17g} "
      "spacing {:.17g} {:.17g} level {} extent {} {}\nstep {:.17g} offset {:.17g} error {:.17g} {}\n",
      TERRANE_VERSION, Manifest::kFormatVersion, name, options.optionsText, options.attribution, plan.crsWkt,
      plan.frame.originEasting, plan.frame.originNorthing, plan.frame.spacingX, plan.frame.spacingY,
      plan.frame.finestLevel, plan.extentCols, plan.extentRows, plan.heightStep, plan.heightOffset,
      plan.maxErrorMeters, plan.interpolates ? "interpolated" : "coded");
  for (const InputRecord& input : plan.inputs) {
    text += fmt::format("input {} {} bytes {} {} x {} {} native {} crs {} resampling {} nodata {}\n",
                        input.name, input.sha256, input.bytes, input.width, input.height, input.dataType,
                        input.nativeLevel, input.sourceCrs, input.resampling, input.noData);
  }
  return text + describeImageryPlan(imagery) + "end\n";
}

/// What the build takes on the disk at most, about: for each sample its heights, raw and filled, and what is
/// known of it, and the result.
uint64_t roomFor(const Source& source) {
  const SourcePlan& plan = source.plan();
  const std::vector<int> levels = source.nativeLevels();
  double tiles = 0.0;
  for (const int level : levels) {
    const int shift = plan.frame.finestLevel - level + 8;
    const auto last = [&](int64_t samples) { return static_cast<int>((samples - 1) >> shift); };
    for (int row = 0; row <= last(plan.extentRows); ++row) {
      for (int col = 0; col <= last(plan.extentCols); ++col)
        tiles += source.mayTouch({level, col, row}) ? 1.0 : 0.0;
    }
  }
  constexpr double kHeightBytes = sizeof(float);
  constexpr double kRankBytes = 3.0 * sizeof(uint16_t);
  constexpr double kResultBytes = 1.5;
  constexpr double kStateBytes = 1.125;
  constexpr double kCoverageBytes = 2.125;
  const bool mixed = levels.size() > 1;
  const bool voids = std::any_of(plan.inputs.begin(), plan.inputs.end(), [](const InputRecord& input) {
    return input.warped || !input.noData.empty();
  });
  double perSample = kHeightBytes + kResultBytes;
  if (mixed || voids) perSample += kHeightBytes + kCoverageBytes;
  if (mixed || voids || plan.interpolates) perSample += kStateBytes;
  if (mixed) perSample += kRankBytes;
  return static_cast<uint64_t>(tiles * kTileSampleCount * perSample * 4.0 / 3.0);
}

/// The build in its work folder, up to the last rename.
Result<BuildReport> buildIn(WorkFolder& work, const Source& source, const ImageryPlan& imagery,
                            const BuildOptions& options, const std::string& name, Progress& progress) {
  const SourcePlan& plan = source.plan();
  const Workers workers(options.threads, options.cancel);
  Jobs jobs(workers, &work.log());
  const Scratch scratch{work.path(), true};
  TERRANE_TRY(checkRoom(work, roomFor(source) + roomForImagery(imagery)));

  // The rasters' own cache is the one thing whose size is ours to choose. Tiles are read row by row: a row of
  // them and the blocks of the rasters that reach into it, twice over; more would only be filled, not used.
  const uint64_t memory = options.memoryBytes > 0 ? options.memoryBytes : quarterOfMemory();
  const uint64_t useful = 2 * (kTileSamples + 512) * static_cast<uint64_t>(plan.extentCols) * sizeof(double);
  constexpr uint64_t kLeast = 32U << 20;
  GDALSetCacheMax64(static_cast<GIntBig>(std::clamp(useful, kLeast, std::max(memory, kLeast))));

  Manifest manifest;
  manifest.name = name;
  manifest.crsWkt = plan.crsWkt;
  manifest.crsName = plan.crsName;
  manifest.frame = plan.frame;
  manifest.extentCols = plan.extentCols;
  manifest.extentRows = plan.extentRows;
  manifest.maxErrorMeters = plan.maxErrorMeters;
  manifest.scale.heightStep = plan.heightStep;
  manifest.scale.heightOffset = plan.heightOffset;
  manifest.scale.sampleError = plan.maxErrorMeters;
  manifest.verticalDatum = plan.verticalDatum;
  manifest.attribution = options.attribution;
  manifest.inputs = plan.inputs;
  manifest.builtBy = "terrane " TERRANE_VERSION;
  manifest.buildOptions = options.optionsText;
  ElevationScale& scale = manifest.scale;

  // Samples: raw from the finest level up, then filled from the root down.
  BuildReport report;
  Pyramid pyramid(plan.frame.finestLevel, scratch);
  {
    const bool mixed = source.nativeLevels().size() > 1;
    std::optional<RankStores> ranks;
    if (mixed) ranks.emplace(scratch);
    RankStores* ranksOrNull = mixed ? &*ranks : nullptr;
    std::optional<NeedStore> needs;
    if (plan.interpolates) needs.emplace(plan.maxErrorMeters, scratch);
    TERRANE_ASSIGN(const RawTotals raw, readRawTiles(source, scale, pyramid, ranksOrNull,
                                                     needs ? &*needs : nullptr, jobs, progress));
    if (raw.samples == 0) {
      work.discard();
      return makeError(
          "the inputs hold no height at all: every sample is nodata; check --nodata and the masks");
    }
    report.samples = static_cast<double>(raw.samples);
    const float corner = scale.heightFromInteger(scale.integerFromHeight(raw.meanHeight));
    TERRANE_TRY(fillTiles(source, pyramid, ranksOrNull, corner, jobs, progress));
  }
  TERRANE_ASSIGN(manifest.coveredCells, coverTiles(pyramid, scratch, jobs));
  TERRANE_TRY(pruneTiles(pyramid, jobs));

  // What the patches get wrong.
  NodeStores stores(scratch);
  TERRANE_ASSIGN(const GroundRange ground, measureNodes(pyramid, stores, jobs, progress));
  const HeightRange range = ground.low <= ground.high ? HeightRange{static_cast<double>(ground.low),
                                                                    static_cast<double>(ground.high)}
                                                      : HeightRange{};
  manifest.minHeight = range.low;
  manifest.maxHeight = range.high;
  chooseCodeUnits(range, plan.maxErrorMeters, plan.frame.finestLevel, scale);
  TERRANE_TRY(saturateNodes(pyramid, stores, scale, plan.maxErrorMeters, jobs));

  // The archive, then the manifest that vouches for it.
  const std::vector<TileId> tiles = storedTiles(pyramid);
  const std::string archive = work.file(kArchiveName);
  TERRANE_TRY(writeArchive(archive, pyramid, stores, scale, tiles, jobs, progress));
  std::error_code code;
  report.archiveBytes = static_cast<uint64_t>(std::filesystem::file_size(archive, code));
  if (code) return makeError("{}: {}", archive, code.message());
  TERRANE_ASSIGN(std::string hash, hashOnce(archive, "hashing", jobs));
  manifest.archives = {{kArchiveName, report.archiveBytes, std::move(hash)}};
  manifest.tileCount = tiles.size();
  for (const PlannedLayer& layer : imagery.layers) {
    const std::string path = work.file(layer.record.archive);
    TERRANE_ASSIGN(ImageryLayerRecord record,
                   buildImageryLayer(imagery, layer, path, scratch, jobs, progress));
    if (record.tileCount == 0) {
      work.discard();
      return makeError(
          "{}: imagery layer '{}' has no texel over the elevation (all is nodata or transparent); leave it "
          "out, or "
          "pass --imagery-nodata",
          layer.pictures.front().input.raster.path, record.name);
    }
    ArchiveRecord file{record.archive, static_cast<uint64_t>(std::filesystem::file_size(path, code)), {}};
    if (code) return makeError("{}: {}", path, code.message());
    TERRANE_ASSIGN(file.sha256, hashOnce(path, "hashing-" + record.name, jobs));
    report.imageryTiles += record.tileCount;
    report.imageryBytes += file.bytes;
    manifest.archives.push_back(std::move(file));
    manifest.imagery.push_back(std::move(record));
  }
  TERRANE_TRY(work.writeFile("manifest.json", manifestToJson(manifest)));
  TERRANE_TRY(workers.checkCancelled());
  TERRANE_TRY(work.commit());

  report.tiles = tiles.size();
  report.bitsPerSample = 8.0 * static_cast<double>(report.archiveBytes) / report.samples;
  report.stages = jobs.reports();
  return report;
}

/// What there is to tell when an earlier run had done all but the tidying up.
Result<BuildReport> reportOf(const std::string& directory) {
  TERRANE_ASSIGN(const Dataset dataset, Dataset::open(directory));
  BuildReport report;
  report.tiles = dataset.manifest().tileCount;
  for (const ArchiveRecord& archive : dataset.manifest().archives)
    (archive.name == kArchiveName ? report.archiveBytes : report.imageryBytes) += archive.bytes;
  for (const ImageryLayerRecord& layer : dataset.manifest().imagery) report.imageryTiles += layer.tileCount;
  return report;
}

}  // namespace

Status checkOutput(const BuildOptions& options) {
  return checkTarget(options.output, options.overwrite);
}

Result<BuildReport> buildDataset(const Source& source, const BuildOptions& options, Progress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  const std::string name =
      std::filesystem::path(options.output + (options.output.ends_with('/') ? "." : "")).stem().string();
  // Pictures that cannot be taken are known before anything is made.
  const SourcePlan& plan = source.plan();
  TERRANE_ASSIGN(
      const std::shared_ptr<const ImageryPlan> imagery,
      planImagery(options.imagery, {plan.crsWkt, plan.frame, plan.extentCols, plan.extentRows}, progress));
  TERRANE_ASSIGN(WorkFolder work, WorkFolder::open(options.output, options.overwrite,
                                                   describePlan(plan, *imagery, options, name), progress));
  if (work.isCommitted()) {
    work.discard();
    return reportOf(options.output);
  }
  auto report = buildIn(work, source, *imagery, options, name, progress);
  if (!report.ok()) {
    if (!work.hasWork()) return report;
    return makeError("{}; run the same command again to go on, or delete {} to start afresh",
                     report.error().message, work.path());
  }
  report->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace terrane
