#include "terrane/bake/build.h"

#include <gdal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

#include "build_output.h"
#include "node_measure.h"
#include "pyramid_steps.h"
#include "terrane/codec/elevation_codec.h"
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
HeightRange rangeOfGround(const Pyramid& pyramid) {
  float low = std::numeric_limits<float>::infinity();
  float high = -low;
  for (const LevelNodes& nodes : pyramid.nodes) {
    for (const float value : nodes.low) low = std::min(low, value);
    for (const float value : nodes.high) high = std::max(high, value);
  }
  return low <= high ? HeightRange{static_cast<double>(low), static_cast<double>(high)} : HeightRange{};
}

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
  TileEncoder(const Pyramid& pyramid, const ElevationScale& scale, int workers)
      : pyramid_(pyramid), scale_(scale), scratches_(static_cast<size_t>(workers)) {}

  Result<std::vector<uint8_t>> encode(int worker, TileId id) {
    Scratch& scratch = scratches_[static_cast<size_t>(worker)];
    const int index = pyramid_.find(id);
    const PyramidTile& tile = pyramid_.levels[static_cast<size_t>(id.level)][static_cast<size_t>(index)];
    Tile& out = scratch.tile;
    TERRANE_TRY(pyramid_.readSamples(tile, out.samples));
    takeNodes(id.level, index, out.nodes);
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
  };

  void takeNodes(int level, int index, TileNodes& out) const {
    const LevelNodes& nodes = pyramid_.nodes[static_cast<size_t>(level)];
    const auto slice = [&](const auto& from, int count, auto& to) {
      const auto begin = from.begin() + static_cast<ptrdiff_t>(index) * count;
      to.assign(begin, begin + count);
    };
    slice(nodes.errorCode, nodes.nodesPerTile, out.error);
    slice(nodes.largeErrorCode, tileLargeNodeCount(level == 0), out.largeError);
    slice(nodes.lowCode, nodes.nodesPerTile, out.low);
    slice(nodes.highCode, nodes.nodesPerTile, out.high);
  }

  ChildSummary summariseChild(const PyramidTile& tile, const Tile& out, int quadrant) const {
    const int32_t child = tile.children[static_cast<size_t>(quadrant)];
    const auto below = static_cast<size_t>(tile.id.level) + 1;
    if (child < 0 || !pyramid_.levels[below][static_cast<size_t>(child)].stored) {
      return summariseMissingChild(out.samples, out.nodes, tile.id.isRoot(), quadrant);
    }
    ChildSummary summary{ChildState::Present, 0, 65535, 0};
    const LevelNodes& nodes = pyramid_.nodes[below];
    const size_t first = static_cast<size_t>(child) * static_cast<size_t>(nodes.nodesPerTile);
    for (size_t i = first; i < first + static_cast<size_t>(nodes.nodesPerTile); ++i) {
      summary.error = std::max(summary.error, nodes.errorCode[i]);
      summary.low = std::min(summary.low, nodes.lowCode[i]);
      summary.high = std::max(summary.high, nodes.highCode[i]);
    }
    return summary;
  }

  const Pyramid& pyramid_;
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

Status writeArchive(const std::string& path, const Pyramid& pyramid, const ElevationScale& scale,
                    const std::vector<TileId>& tiles, const Workers& workers, Progress& progress) {
  progress.beginStage("encoding", static_cast<int64_t>(tiles.size()), "tiles");
  TERRANE_ASSIGN(PmtilesWriter writer, PmtilesWriter::create(path));
  TileEncoder encoder(pyramid, scale, workers.count());
  const Status done = workers.forEachInOrder(
      static_cast<int64_t>(tiles.size()),
      [&](int worker, int64_t i) { return encoder.encode(worker, tiles[static_cast<size_t>(i)]); },
      [&](int64_t i, const std::vector<uint8_t>& bytes) -> Status {
        TERRANE_TRY(writer.add(tiles[static_cast<size_t>(i)], bytes));
        progress.advance(1);
        return {};
      });
  TERRANE_TRY(done);
  return writer.finish(R"({"name":"elevation","format":"terrane elevation payload 2"})");
}

}  // namespace

Status checkOutput(const BuildOptions& options) {
  return checkTarget(options.output, options.overwrite);
}

Result<BuildReport> buildDataset(const Source& source, const BuildOptions& options, Progress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  const SourcePlan& plan = source.plan();
  const Workers workers(options.threads, options.cancel);
  TERRANE_ASSIGN(PendingDirectory output, PendingDirectory::create(options.output, options.overwrite));
  const uint64_t memory = options.memoryBytes > 0 ? options.memoryBytes : quarterOfMemory();
  // The rasters' own cache is part of what the build may take.
  GDALSetCacheMax64(static_cast<GIntBig>(std::max<uint64_t>(memory / 8, 32U << 20)));

  Manifest manifest;
  manifest.name =
      std::filesystem::path(options.output + (options.output.ends_with('/') ? "." : "")).stem().string();
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

  // Samples: raw from the finest level up, then filled from the root down. Most of the memory is theirs; what
  // they do not fit into goes to a scratch file.
  BuildReport report;
  Pyramid pyramid(plan.frame.finestLevel, memory / 8 * 5, output.path());
  {
    const bool mixed = source.nativeLevels().size() > 1;
    std::optional<RankStores> ranks;
    if (mixed) ranks.emplace(memory / 8, output.path());
    RankStores* ranksOrNull = mixed ? &*ranks : nullptr;
    std::optional<NeedStore> needs;
    if (plan.interpolates) needs.emplace(plan.maxErrorMeters, memory / 8, output.path());
    TERRANE_ASSIGN(const RawTotals raw, readRawTiles(source, scale, pyramid, ranksOrNull,
                                                     needs ? &*needs : nullptr, workers, progress));
    report.samples = static_cast<double>(raw.samples);
    const float corner = scale.heightFromInteger(scale.integerFromHeight(raw.meanHeight));
    TERRANE_TRY(fillTiles(source, pyramid, ranksOrNull, corner, workers, progress));
  }
  TERRANE_ASSIGN(manifest.coveredCells, coverTiles(pyramid, workers));
  TERRANE_TRY(pruneTiles(pyramid, workers));

  // What the patches get wrong.
  TERRANE_TRY(measureNodes(pyramid, workers, progress));
  const HeightRange range = rangeOfGround(pyramid);
  manifest.minHeight = range.low;
  manifest.maxHeight = range.high;
  chooseCodeUnits(range, plan.maxErrorMeters, plan.frame.finestLevel, scale);
  TERRANE_TRY(saturateNodes(pyramid, scale, plan.maxErrorMeters, workers));
  TERRANE_TRY(saturateLargeNodes(pyramid, scale, plan.maxErrorMeters, workers));

  // The archive, then the manifest that vouches for it.
  const std::vector<TileId> tiles = storedTiles(pyramid);
  const std::string archive = output.file(kArchiveName);
  TERRANE_TRY(writeArchive(archive, pyramid, scale, tiles, workers, progress));
  std::error_code code;
  report.archiveBytes = static_cast<uint64_t>(std::filesystem::file_size(archive, code));
  if (code) return makeError("{}: {}", archive, code.message());
  TERRANE_ASSIGN(std::string hash, sha256OfFile(archive));
  manifest.archives = {{kArchiveName, report.archiveBytes, std::move(hash)}};
  manifest.tileCount = tiles.size();
  TERRANE_TRY(output.writeFile("manifest.json", manifestToJson(manifest)));
  TERRANE_TRY(workers.checkCancelled());
  TERRANE_TRY(output.commit());

  report.tiles = tiles.size();
  report.bitsPerSample = 8.0 * static_cast<double>(report.archiveBytes) / report.samples;
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace terrane
