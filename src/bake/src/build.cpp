#include "terrane/bake/build.h"

#include <gdal.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string_view>

#include "build_output.h"
#include "imagery_build.h"
#include "node_measure.h"
#include "pyramid_steps.h"
#include "terrane/dataset/dataset.h"
#include "terrane/dataset/hash.h"
#include "terrane/dataset/pmtiles.h"
#include "tile_encoder.h"

namespace terrane {

namespace {

constexpr std::string_view kAppendWord = "\nappend ";  ///< in a plan, before the old manifest's hash

/// Height of ground, lowest and highest, over all stored tiles.
struct HeightRange {
  double low = 0.0;
  double high = 0.0;
};

/// The smallest unit * 2^n, n >= 0, that is at least `least`.
double doubledUpTo(double least, double unit) {
  while (unit < least) unit *= 2.0;
  return unit;
}

/// Codes that tell small errors apart and never run out. All units go in coarse steps, so that a range that
/// grows somewhat, as datasets do that are added to, leaves them as they are, and payloads with them.
void chooseCodeUnits(const HeightRange& range, double maxErrorMeters, int finestLevel,
                     ElevationScale& scale) {
  // The largest error, and one code more for each bintree level above it, must stay below 255.
  const double largest = std::max(2.0 * (range.high - range.low), scale.heightStep) + 2.0 * maxErrorMeters;
  const double codesLeft = 254.0 - 2.0 * (finestLevel + 8);
  scale.errorUnit = doubledUpTo(largest / std::exp2(codesLeft / 8.0), scale.heightStep / 64.0);
  // Ranges a little wider than the ground's, so that rounding cannot push a height out.
  const double slack = 1e-6 * (1.0 + std::abs(range.low) + std::abs(range.high));
  const double low = range.low - maxErrorMeters - slack;
  const double high = range.high + maxErrorMeters + slack;
  // At most 2047 of the 65535 codes, and none finer than the heights' own step: a height range need not be
  // finer, and its lowest bits would cost bytes. They begin up to 64 codes lower: where ranges appear out of
  // void, it is their codes that cost bits.
  scale.rangeUnit = doubledUpTo((high - low) / 2047.0, scale.heightStep);
  const double stride = 64.0 * scale.rangeUnit;
  scale.rangeBase = scale.heightOffset + std::floor((low - scale.heightOffset) / stride) * stride;
}

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

/// A tile in the archive.
struct WrittenTile {
  PmtilesPlace place;
  uint64_t copied = 0;  ///< 1: from the dataset that is added to
};

/// The bounds of all layers of significance but the last.
Result<std::vector<double>> chooseLayers(const Source& source, const BuildOptions& options,
                                         Progress& progress) {
  const SourcePlan& plan = source.plan();
  std::vector<double> bounds = options.layerErrors;
  if (options.layersBySpacing) {
    if (!plan.interpolates) {
      progress.warn(
          "--layers auto: one layer, since every sample is kept; a larger --max-error leaves some to "
          "interpolation");
      return bounds;
    }
    // What a pixel takes of the ground afar and halfway, and not where the next layer would say little more.
    constexpr double kLeastRatio = 2.5;
    const double spacing = std::max(plan.frame.spacingXMeters(), plan.frame.spacingYMeters());
    for (const double share : {1.6, 0.4})
      if (share * spacing >= kLeastRatio * plan.maxErrorMeters) bounds.push_back(share * spacing);
    if (bounds.empty())
      progress.warn(
          fmt::format("--layers auto: one layer, since little is left out within {:g} m; a smaller "
                      "--max-error allows more",
                      plan.maxErrorMeters));
    return bounds;
  }
  if (bounds.empty()) return bounds;
  const std::string said = fmt::format("--layers {}", fmt::join(bounds, ","));
  if (!plan.interpolates) {
    return makeError(
        "{}: a dataset that keeps every sample of its inputs has one layer; give a larger --max-error, or "
        "leave --layers out",
        said);
  }
  constexpr size_t kMost = ElevationScale::kMostLayers - 1;
  double above = 1e9;
  for (const double bound : bounds) {
    if (!(bound > plan.maxErrorMeters && bound < above) || bounds.size() > kMost) {
      return makeError("{}: must be 1 to {} falling numbers of metres, all above the dataset's own {:g} m",
                       said, kMost, plan.maxErrorMeters);
    }
    above = bound;
  }
  return bounds;
}

/// Writes the archive of a layer; gives how many of its tiles were copied.
Result<uint64_t> writeArchive(const std::string& path, TileEncoder& encoder, int layer,
                              const std::vector<TileId>& tiles, Jobs& jobs, Progress& progress) {
  const std::string stage = layer == 0 ? "encoding" : fmt::format("encoding {}", layer);
  const std::string about =
      layer == 0
          ? R"({"name":"elevation","format":"terrane elevation payload 4"})"
          : fmt::format(R"({{"name":"elevation-{}","format":"terrane elevation refinement 1"}})", layer);
  progress.beginStage(stage, static_cast<int64_t>(tiles.size()), "tiles");
  std::optional<PmtilesWriter> writer;
  std::vector<uint8_t> copied(tiles.size(), 0);  // each job has its own
  const Status done = jobs.runInOrder<WrittenTile>(
      stage, static_cast<int64_t>(tiles.size()), &progress,
      [&](std::span<const WrittenTile> before) -> Status {
        std::vector<PmtilesPlace> places;
        for (const WrittenTile& tile : before) {
          copied[places.size()] = tile.copied != 0 ? 1 : 0;
          places.push_back(tile.place);
        }
        TERRANE_ASSIGN(writer, PmtilesWriter::goOn(path, places));
        return {};
      },
      [&](int worker, int64_t i) -> Result<std::vector<uint8_t>> {
        TERRANE_ASSIGN(EncodedTile tile, encoder.encode(worker, tiles[static_cast<size_t>(i)], layer));
        copied[static_cast<size_t>(i)] = tile.copied ? 1 : 0;
        return std::move(tile.bytes);
      },
      [&](int64_t i, const std::vector<uint8_t>& bytes) -> Result<WrittenTile> {
        TERRANE_ASSIGN(const PmtilesPlace place, writer->add(tiles[static_cast<size_t>(i)], bytes));
        return WrittenTile{place, copied[static_cast<size_t>(i)]};
      });
  TERRANE_TRY(done);
  TERRANE_TRY(writer->finish(about));
  return static_cast<uint64_t>(std::count(copied.begin(), copied.end(), 1));
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

/// All that shapes the result, as text. A work folder with another plan is of no use. `base`: the hash of the
/// manifest of the dataset that is added to, empty for none.
std::string describePlan(const SourcePlan& plan, const std::vector<double>& layers,
                         const ImageryPlan& imagery, const BuildOptions& options, const std::string& name,
                         const std::string& base) {
  std::string text = fmt::format(
      "terrane {} work 2 dataset {} payload 4\nname {}\noptions {}\nattribution {}\ncrs {}\norigin {:.17g} "
      "{:.17g} "
      "spacing {:.17g} {:.17g} level {} extent {} {}\nstep {:.17g} offset {:.17g} error {:.17g} {}\n",
      TERRANE_VERSION, Manifest::kFormatVersion, name, options.optionsText, options.attribution, plan.crsWkt,
      plan.frame.originEasting, plan.frame.originNorthing, plan.frame.spacingX, plan.frame.spacingY,
      plan.frame.finestLevel, plan.extentCols, plan.extentRows, plan.heightStep, plan.heightOffset,
      plan.maxErrorMeters, plan.interpolates ? "interpolated" : "coded");
  for (const double bound : layers) text += fmt::format("layer within {:.17g}\n", bound);
  for (const InputRecord& input : plan.inputs) {
    text += fmt::format("input {} {} bytes {} {} x {} {} native {} crs {} resampling {} nodata {}\n",
                        input.name, input.sha256, input.bytes, input.width, input.height, input.dataType,
                        input.nativeLevel, input.sourceCrs, input.resampling, input.noData);
  }
  text += describeImageryPlan(imagery);
  if (!base.empty()) text += fmt::format("{}{}\n", kAppendWord.substr(1), base);
  return text + "end\n";
}

/// The plan to work by where a dataset is added to. It is that of an earlier run of the same command, if that
/// one had just put its dataset in place when it was killed: what stands there now is the result, and this
/// run's inputs are its last ones already.
std::string describeAppending(const Source& source, const std::vector<double>& layers,
                              const ImageryPlan& imagery, const BuildOptions& options,
                              const std::string& name) {
  const AppendBase& base = *source.base();
  std::string text = describePlan(source.plan(), layers, imagery, options, name, base.manifestSha256);
  const std::string committed = committedPlan(options.output);
  const size_t word = committed.rfind(kAppendWord);
  if (word == std::string::npos) return text;
  const std::string hash = committed.substr(word + kAppendWord.size(), base.manifestSha256.size());
  SourcePlan plan = source.plan();
  const auto there = static_cast<ptrdiff_t>(base.dataset->manifest().inputs.size());
  const auto added = static_cast<ptrdiff_t>(plan.inputs.size()) - there;
  if (added > there) return text;
  plan.inputs.erase(plan.inputs.begin() + there - added, plan.inputs.begin() + there);
  std::string before = describePlan(plan, layers, imagery, options, name, hash);
  return before == committed ? before : text;
}

/// Errors: the dataset that is added to is no longer the one that was opened.
Status checkBaseStands(const AppendBase& base) {
  const auto hash = sha256OfFile(base.dataset->directory() + "/manifest.json");
  if (hash.ok() && *hash == base.manifestSha256) return {};
  return makeError("{}: was replaced while it was read; run the same command again",
                   base.dataset->directory());
}

/// The options of the dataset that is added to, and those that are new.
std::string joinOptions(const std::string& before, const std::string& added) {
  if (before.empty() || added.empty()) return before + added;
  return before.find(added) != std::string::npos ? before : before + " " + added;
}

/// What the build takes on the disk at most, about: for each sample its heights, raw and filled, and what is
/// known of it, and the result.
uint64_t roomFor(const Source& source, const std::vector<double>& layers) {
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
  constexpr double kNeedBytes = 0.125;
  constexpr double kStateBytes = 1.0;
  constexpr double kLayerBytes = 1.0;
  constexpr double kCoverageBytes = 2.125;
  const bool mixed = levels.size() > 1;
  const bool voids = std::any_of(plan.inputs.begin(), plan.inputs.end(), [](const InputRecord& input) {
    return input.warped || !input.noData.empty();
  });
  double perSample = kHeightBytes + kResultBytes;
  if (mixed || voids) perSample += kHeightBytes + kCoverageBytes;
  if (mixed || voids || plan.interpolates) perSample += kStateBytes + kNeedBytes;
  if (!layers.empty()) perSample += kLayerBytes + static_cast<double>(layers.size()) * kNeedBytes;
  if (mixed) perSample += kRankBytes;
  return static_cast<uint64_t>(tiles * kTileSampleCount * perSample * 4.0 / 3.0);
}

/// Says so where the lowest or highest ground is at a height that mostly stands for no data.
void warnOfSentinels(const HeightRange& range, Progress& progress) {
  for (const double height : {-9999.0, -32767.0, -32768.0, -99999.0, 32767.0, 65535.0}) {
    if (range.low == height || range.high == height)
      progress.warn(fmt::format(
          "there is ground at {0:g} m, which mostly stands for no data; if it does, pass --nodata {0:g}",
          height));
  }
}

/// The build in its work folder, up to the last rename.
Result<BuildReport> buildIn(WorkFolder& work, const Source& source, const std::vector<double>& layers,
                            const ImageryPlan& imagery, const BuildOptions& options, const std::string& name,
                            Progress& progress) {
  const SourcePlan& plan = source.plan();
  const Workers workers(options.threads, options.cancel);
  Jobs jobs(workers, &work.log());
  const Scratch scratch{work.path(), true};
  TERRANE_TRY(checkRoom(work, roomFor(source, layers) + roomForImagery(imagery)));

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
  if (!layers.empty()) {
    manifest.scale.layerCount = static_cast<int>(layers.size()) + 1;
    std::copy(layers.begin(), layers.end(), manifest.scale.layerErrors.begin());
    manifest.scale.layerErrors[layers.size()] = plan.maxErrorMeters;
  }
  manifest.verticalDatum = plan.verticalDatum;
  manifest.attribution = options.attribution;
  manifest.inputs = plan.inputs;
  manifest.builtBy = "terrane " TERRANE_VERSION;
  manifest.buildOptions = options.optionsText;
  if (const AppendBase* base = source.base(); base != nullptr) {
    const Manifest& before = base->dataset->manifest();
    if (manifest.attribution.empty()) manifest.attribution = before.attribution;
    manifest.buildOptions = joinOptions(before.buildOptions, options.optionsText);
  }
  ElevationScale& scale = manifest.scale;

  // Samples: raw from the finest level up, then filled from the root down.
  BuildReport report;
  Pyramid pyramid(plan.frame.finestLevel, scratch, scale.layerCount);
  {
    const bool mixed = source.nativeLevels().size() > 1;
    std::optional<RankStores> ranks;
    if (mixed) ranks.emplace(scratch);
    RankStores* ranksOrNull = mixed ? &*ranks : nullptr;
    std::optional<NeedStore> needs;
    std::vector<double> bounds = layers;
    bounds.push_back(plan.maxErrorMeters);
    if (plan.interpolates) needs.emplace(std::move(bounds), scratch);
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
  if (manifest.coveredCells == 0.0)
    progress.warn(
        "there is no ground: nowhere are the four samples around a cell there; nothing will be seen");
  TERRANE_TRY(pruneTiles(pyramid, jobs));

  // What the patches get wrong.
  NodeStores stores(scratch);
  TERRANE_ASSIGN(const GroundRange ground, measureNodes(pyramid, stores, jobs, progress));
  const HeightRange range = ground.low <= ground.high ? HeightRange{static_cast<double>(ground.low),
                                                                    static_cast<double>(ground.high)}
                                                      : HeightRange{};
  manifest.minHeight = range.low;
  manifest.maxHeight = range.high;
  warnOfSentinels(range, progress);
  chooseCodeUnits(range, plan.maxErrorMeters, plan.frame.finestLevel, scale);
  TERRANE_TRY(saturateNodes(pyramid, stores, scale, plan.maxErrorMeters, jobs));
  scale.roughness =
      roughnessOf(pyramid, scale, std::max(plan.frame.spacingXMeters(), plan.frame.spacingYMeters()));
  TERRANE_ASSIGN(manifest.zeroShare, zeroShareOf(pyramid, plan.maxErrorMeters));

  // The archives, then the manifest that vouches for them.
  const std::vector<TileId> tiles = storedTiles(pyramid);
  TileEncoder encoder(pyramid, stores, manifest, source.base(), workers.count());
  std::error_code code;
  for (int layer = 0; layer < scale.layerCount; ++layer) {
    const std::string archive = work.file(elevationArchiveName(layer));
    TERRANE_ASSIGN(const uint64_t tilesCopied, writeArchive(archive, encoder, layer, tiles, jobs, progress));
    if (layer == 0) report.tilesCopied = tilesCopied;
    ArchiveRecord file{
        elevationArchiveName(layer), static_cast<uint64_t>(std::filesystem::file_size(archive, code)), {}};
    if (code) return makeError("{}: {}", archive, code.message());
    TERRANE_ASSIGN(file.sha256,
                   hashOnce(archive, layer == 0 ? "hashing" : fmt::format("hashing {}", layer), jobs));
    report.archiveBytes += file.bytes;
    manifest.archives.push_back(std::move(file));
  }
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
  report.archiveBytes = elevationBytes(dataset.manifest());
  for (const ArchiveRecord& archive : dataset.manifest().archives) report.imageryBytes += archive.bytes;
  report.imageryBytes -= report.archiveBytes;
  for (const ImageryLayerRecord& layer : dataset.manifest().imagery) report.imageryTiles += layer.tileCount;
  return report;
}

}  // namespace

Status checkOutput(const BuildOptions& options) {
  return checkTarget(options.output, options.overwrite);
}

Result<BuildReport> buildDataset(const Source& source, const BuildOptions& options, Progress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  const std::string name = datasetNameOf(options.output);
  // Pictures that cannot be taken are known before anything is made.
  const SourcePlan& plan = source.plan();
  TERRANE_ASSIGN(
      const std::shared_ptr<const ImageryPlan> imagery,
      planImagery(options.imagery, {plan.crsWkt, plan.frame, plan.extentCols, plan.extentRows}, progress));
  TERRANE_ASSIGN(const std::vector<double> layers, chooseLayers(source, options, progress));
  const bool appends = source.base() != nullptr;
  const std::string planText = appends ? describeAppending(source, layers, *imagery, options, name)
                                       : describePlan(plan, layers, *imagery, options, name, "");
  TERRANE_ASSIGN(WorkFolder work,
                 WorkFolder::open(options.output, options.overwrite || appends, planText, progress));
  if (work.isCommitted()) {
    work.discard();
    return reportOf(options.output);
  }
  if (appends) TERRANE_TRY(checkBaseStands(*source.base()));
  auto report = buildIn(work, source, layers, *imagery, options, name, progress);
  if (!report.ok()) {
    if (!work.hasWork()) return report;
    return makeError("{}; run the same command again to go on, or delete {} to start afresh",
                     report.error().message, work.path());
  }
  report->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace terrane
