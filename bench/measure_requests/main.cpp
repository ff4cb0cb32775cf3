#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>

#include "archive_map.h"
#include "imagery_selection.h"
#include "terrane/engine/read_flight.h"
#include "terrane/measure/bench_result.h"
#include "terrane/measure/fly.h"
#include "terrane/scene/stream_flight.h"

/// Where requests and bytes of a streamed flight go: what its cameras need with everything known, each tile
/// once, against what is fetched, by kind and level; over a simulated line.
///
/// usage: measure_requests FLIGHT.json RESULT.json DATASET...

namespace terrane {
namespace {

constexpr LineModel kLine{40e6 / 8.0, 0.05};
constexpr double kSeconds = 10.0;
constexpr double kFramesPerSecond = 60.0;
constexpr int kWidth = 1280, kHeight = 720;
/// What pages are measured with, and what it must not take more of.
constexpr const char* kPageDataset = "demo_web";
constexpr double kMostRequests = 90.0;
constexpr double kMostMegabytes = 3.5;

struct NamedSurface {
  const char* name;
  SurfaceKind surface;
};
constexpr NamedSurface kSurfaces[] = {{"patches", SurfaceKind::Patches}, {"meshes", SurfaceKind::Meshes}};

/// A tile counts for `need` from here on.
using Tiles = std::set<TileKey>;

/// An elevation tile with its layers of significance up to one.
void addWithAncestors(TileId id, int layer, Tiles& out) {
  for (; layer >= 0; --layer)
    for (TileId at = id; out.insert(TileKey::elevation(at, layer)).second && !at.isRoot();) at = at.parent();
}

/// What a cut is drawn from. note: lighting takes what is here, so its tiles count with their first layer.
void addDrawn(const Cut& cut, const Manifest& manifest, Tiles& out) {
  const MeshScale meshScale = MeshScale::of(manifest.frame, manifest.scale);
  for (const Patch& patch : cut.patches) {
    const int layer = cut.surface == SurfaceKind::Meshes ? meshScale.layerOf(patch.triangle.diamond.level)
                                                         : manifest.scale.layerCount - 1;
    addWithAncestors(patch.tile, layer, out);
    addWithAncestors(patch.shadingTile, 0, out);
  }
}

/// What all cameras of the flight need with everything known.
Result<Tiles> neededTiles(Terrain& terrain, const FittedFlight& flight, const PatchSelection& selection) {
  FlyOptions fly;
  fly.width = kWidth;
  fly.height = kHeight;
  const Manifest& manifest = terrain.dataset().manifest();
  std::vector<Tiles> pictures;
  for (size_t i = 0; i < manifest.imagery.size(); ++i) {
    Tiles stored;
    for (const TileId id : terrain.dataset().imageryTiles(i)) stored.insert({static_cast<int32_t>(i), id});
    pictures.push_back(std::move(stored));
  }
  Tiles out;
  const auto frames = static_cast<int>(kSeconds * kFramesPerSecond);
  for (int i = 0; i <= frames; ++i) {
    const Camera camera = cameraAt(flight, i / kFramesPerSecond, fly);
    TERRANE_ASSIGN(const Cut cut, terrain.selectAndLoad(camera, selection));
    addDrawn(cut, manifest, out);
    const auto hasDeeper = [&](TileId id) {
      for (size_t layer = 0; layer < pictures.size(); ++layer)
        for (int quadrant = 0; quadrant < 4; ++quadrant)
          if (pictures[layer].count({static_cast<int32_t>(layer), id.child(quadrant)}) > 0) return true;
      return false;
    };
    for (size_t layer = 0; layer < pictures.size(); ++layer) {
      for (const ImageryNeed& need :
           selectImagery({camera, selection.exaggeration, manifest, terrain.tiles(), hasDeeper}, 4096)) {
        const TileKey key{static_cast<int32_t>(layer), need.tile};
        if (pictures[layer].count(key) > 0) out.insert(key);
      }
    }
  }
  return out;
}

/// Notes every request on its way to the line.
class NotingTransport final : public Transport {
 public:
  NotingTransport(std::unique_ptr<Transport> line, std::vector<FetchRequest>& notes)
      : line_(std::move(line)), notes_(notes) {}
  void start(uint64_t id, const FetchRequest& request) override {
    notes_.push_back(request);
    line_->start(id, request);
  }
  void cancel(uint64_t id) override { line_->cancel(id); }
  std::vector<FetchAnswer> poll(double nowSeconds) override { return line_->poll(nowSeconds); }
  const std::string& where() const override { return line_->where(); }

 private:
  std::unique_ptr<Transport> line_;
  std::vector<FetchRequest>& notes_;
};

struct Sum {
  uint64_t tiles = 0, bytes = 0;
  void add(uint64_t more) {
    ++tiles;
    bytes += more;
  }
};

double megabytes(uint64_t bytes) {
  return static_cast<double>(bytes) / 1e6;
}

Status measure(const std::string& directory, const FittedFlight& flight, Terrain& terrain,
               SurfaceKind surface, nlohmann::ordered_json& row, BenchResult& result) {
  PatchSelection selection;
  selection.surface = surface;
  TERRANE_ASSIGN(const Tiles needed, neededTiles(terrain, flight, selection));
  TERRANE_ASSIGN(const ArchiveMap archives, ArchiveMap::of(terrain.dataset()));

  std::vector<FetchRequest> requests;
  StreamFlightOptions options;
  options.line = kLine;
  options.width = kWidth;
  options.height = kHeight;
  options.durationSeconds = kSeconds;
  options.framesPerSecond = kFramesPerSecond;
  options.draw = false;
  options.view.selection = selection;
  options.wrapLine = [&](std::unique_ptr<Transport> line) {
    return std::make_unique<NotingTransport>(std::move(line), requests);
  };
  Tiles used;
  size_t atStart = 0;
  options.afterFrame = [&](const TerrainView& view) {
    if (atStart == 0) atStart = requests.size();
    addDrawn(view.cut(), terrain.dataset().manifest(), used);
  };
  FlyOptions fly;
  fly.width = kWidth;
  fly.height = kHeight;
  SilentProgress silent;
  TERRANE_ASSIGN(const StreamFlightReport report,
                 flyStream(
                     directory, [&](double seconds) { return cameraAt(flight, seconds, fly); }, nullptr,
                     nullptr, options, silent));

  // Every tile in a range that was asked for is fetched, whether as a wish or in a gap.
  std::map<std::pair<int, int>, std::map<std::string, Sum>> table;  // layer, level -> column
  std::map<std::string, Sum> sums;
  Tiles fetched;
  uint64_t other = 0;
  for (const FetchRequest& request : requests) {
    const auto tiles = archives.tilesIn(request);
    const uint64_t whole = request.bytes != 0 ? request.bytes : archives.manifestBytes();
    uint64_t inTiles = 0;
    for (const auto& [key, bytes] : tiles) {
      inTiles += bytes;
      const char* kind = !fetched.insert(key).second ? "again"
                         : needed.count(key) > 0     ? "needed"
                         : used.count(key) > 0       ? "used"
                                                     : "unneeded";
      table[{key.layer, key.tile.level}][kind].add(bytes);
      sums[(key.isElevation() ? "elevation_" : "imagery_") + std::string(kind)].add(bytes);
    }
    other += whole - inTiles;
  }
  for (const TileKey& key : needed) {
    const uint64_t bytes = archives.bytesOf(key);
    table[{key.layer, key.tile.level}]["oracle"].add(bytes);
    sums[key.isElevation() ? "elevation_oracle" : "imagery_oracle"].add(bytes);
    if (fetched.count(key) == 0) table[{key.layer, key.tile.level}]["missed"].add(bytes);
  }
  std::fprintf(stderr, "%s, %s: tiles and kB\n", row["dataset"].get<std::string>().c_str(),
               row["surface"].get<std::string>().c_str());
  for (auto& [at, columns] : table) {
    std::fprintf(stderr, "  layer %2d level %2d", at.first, at.second);
    for (const char* name : {"oracle", "needed", "used", "unneeded", "again", "missed"})
      std::fprintf(stderr, "  %s %3llu %7.1f", name, static_cast<unsigned long long>(columns[name].tiles),
                   1e-3 * static_cast<double>(columns[name].bytes));
    std::fprintf(stderr, "\n");
  }
  const StreamStatistics& last = summaryOf(report).stream;
  row["requests"] = last.requests;
  row["at_start"] = atStart;
  row["cancelled"] = last.requestsCancelled;
  row["mb"] = megabytes(last.bytesReceived);
  row["unwanted_mb"] = megabytes(last.bytesUnwanted);
  row["other_mb"] = megabytes(other);
  for (const char* name : {"elevation_oracle", "elevation_needed", "elevation_used", "elevation_unneeded",
                           "imagery_oracle", "imagery_needed", "imagery_unneeded"}) {
    row[std::string(name)] = sums[name].tiles;
    row[std::string(name) + "_mb"] = megabytes(sums[name].bytes);
  }
  row["again_mb"] = megabytes(sums["elevation_again"].bytes + sums["imagery_again"].bytes);
  double triangles = 0.0;
  for (const StreamFlightFrame& frame : report.frames) triangles += static_cast<double>(frame.view.triangles);
  row["triangles"] = triangles / static_cast<double>(report.frames.size());
  row["debt_px_s"] = report.debtPixelSeconds;
  if (row["dataset"] == kPageDataset) {
    const std::string prefix = row["surface"].get<std::string>() + "_";
    result.bars.push_back({prefix + "requests", static_cast<double>(last.requests), "", kMostRequests});
    result.bars.push_back({prefix + "mb", megabytes(last.bytesReceived), "MB", kMostMegabytes});
  }
  return {};
}

Status run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 3) return makeError("usage: measure_requests FLIGHT.json RESULT.json DATASET...");
  BenchResult result;
  result.bench = "requests";
  for (size_t i = 2; i < arguments.size(); ++i) {
    for (const NamedSurface& of : kSurfaces) {
      TERRANE_ASSIGN(const std::unique_ptr<Terrain> terrain, Terrain::open(arguments[i]));
      TERRANE_ASSIGN(const FittedFlight flight, readFlight(arguments[0], *terrain));
      nlohmann::ordered_json row{{"dataset", std::filesystem::path(arguments[i]).stem().string()},
                                 {"surface", of.name}};
      TERRANE_TRY(measure(arguments[i], flight, *terrain, of.surface, row, result));
      result.rows.push_back(std::move(row));
    }
  }
  return finishBench(result, arguments[1]);
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  return terrane::benchMain("measure_requests", argc, argv, terrane::run);
}
