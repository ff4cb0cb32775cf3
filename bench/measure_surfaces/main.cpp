#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <set>

#include "cpu_time.h"
#include "terrane/engine/default_style.h"
#include "terrane/engine/read_flight.h"
#include "terrane/measure/bench_result.h"
#include "terrane/measure/fly.h"
#include "terrane/scene/stream_flight.h"
#include "tile_work.h"

/// The surfaces side by side: one flight at equal tau over each dataset, which comes over a simulated line;
/// what a frame is made of, what comes over the line, what it costs to decode, to make, to choose and, with
/// the software rasteriser, to draw.
///
/// usage: measure_surfaces FLIGHT.json RESULT.json DATASET...

namespace terrane {
namespace {

constexpr LineModel kLine{40e6 / 8.0, 0.05};
constexpr double kTauPixels = 1.0;
constexpr double kSeconds = 10.0;
constexpr int kWidth = 1280, kHeight = 720;
/// Pictures that are drawn, over the flight, each so many times.
constexpr int kDrawnPictures = 5;
constexpr int kTimesDrawn = 3;
constexpr int kDrawnWidth = 640, kDrawnHeight = 360;
/// The bar is that of the flight that pages are measured with, over this dataset.
constexpr const char* kPageDataset = "demo_web";

struct NamedSurface {
  const char* name;
  SurfaceKind surface;
};
constexpr NamedSurface kSurfaces[] = {{"patches", SurfaceKind::Patches}, {"meshes", SurfaceKind::Meshes}};

PatchSelection selectionOf(SurfaceKind surface) {
  PatchSelection out;
  out.surface = surface;
  out.tolerancePixels = kTauPixels;
  return out;
}

double percentile95(std::vector<double> values) {
  const auto at = values.begin() + static_cast<ptrdiff_t>(values.size() * 95 / 100);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double megabytes(uint64_t bytes) {
  return static_cast<double>(bytes) / 1e6;
}

/// The flight streamed, and the workers' part of it again.
Status measureStream(const Terrain& terrain, const FittedFlight& flight, SurfaceKind surface,
                     nlohmann::ordered_json& row, double& mostTriangles) {
  const std::string& directory = terrain.dataset().directory();
  StreamFlightOptions options;
  options.line = kLine;
  options.width = kWidth;
  options.height = kHeight;
  options.durationSeconds = kSeconds;
  options.draw = false;
  options.view.selection = selectionOf(surface);
  const Manifest& manifest = terrain.dataset().manifest();
  UsedTiles used(MeshScale::of(manifest.frame, manifest.scale));
  double tilesDrawn = 0.0;
  options.afterFrame = [&](const TerrainView& view) {
    used.add(view.cut());
    std::set<TileId> drawn;
    for (const Patch& patch : view.cut().patches) drawn.insert(patch.tile);
    tilesDrawn += static_cast<double>(drawn.size());
  };
  FlyOptions fly;
  fly.width = kWidth;
  fly.height = kHeight;
  SilentProgress silent;
  TERRANE_ASSIGN(const StreamFlightReport report,
                 flyStream(
                     directory, [&](double seconds) { return cameraAt(flight, seconds, fly); }, nullptr,
                     nullptr, options, silent));

  double triangles = 0.0, patches = 0.0;
  uint64_t tileBytes = 0, meshBytes = 0;
  std::vector<double> selecting;
  for (const StreamFlightFrame& frame : report.frames) {
    triangles += static_cast<double>(frame.view.triangles);
    patches += static_cast<double>(frame.view.patches);
    mostTriangles = std::max(mostTriangles, static_cast<double>(frame.view.triangles));
    tileBytes = std::max(tileBytes, frame.view.stream.decodedBytes);
    meshBytes = std::max(meshBytes, frame.view.meshBytes);
    selecting.push_back(frame.view.selectSeconds * 1e3);
  }
  const auto frames = static_cast<double>(report.frames.size());
  const StreamFlightSummary summary = summaryOf(report);
  row["frames"] = report.frames.size();
  row["triangles"] = std::llround(triangles / frames);
  row["triangles_max"] = std::llround(mostTriangles);
  row["patches"] = std::llround(patches / frames);
  row["tiles"] = tilesDrawn / frames;
  row["requests"] = summary.stream.requests;
  row["mb"] = megabytes(summary.stream.bytesReceived);
  row["debt_px_s"] = report.debtPixelSeconds;
  row["tiles_mb"] = megabytes(tileBytes);
  row["meshes_mb"] = megabytes(meshBytes);
  row["select_ms"] = median(selecting);
  row["select_p95_ms"] = percentile95(selecting);

  TERRANE_ASSIGN(const TileWork work, doTileWork(terrain.dataset(), used));
  row["tiles_used"] = work.tiles;
  row["decode_s"] = work.decodeSeconds;
  row["mesh_levels"] = work.meshLevels;
  row["mesh_s"] = work.meshSeconds;
  row["mesh_mtris"] =
      work.meshSeconds > 0.0 ? 1e-6 * static_cast<double>(work.meshTriangles) / work.meshSeconds : 0.0;
  return {};
}

/// Some frames drawn by the software rasteriser, all tiles resident and uploaded.
Status measureDrawing(Terrain& terrain, const FittedFlight& flight, SurfaceKind surface,
                      nlohmann::ordered_json& row) {
  FlyOptions fly;
  fly.width = kDrawnWidth;
  fly.height = kDrawnHeight;
  const PatchSelection selection = selectionOf(surface);
  const RenderStyle style = defaultStyle(terrain.dataset().manifest());
  std::vector<double> frameMs, cpuMs;
  int64_t triangles = 0;
  int calls = 0;
  uint64_t gpuBytes = 0;
  for (int i = 0; i < kDrawnPictures; ++i) {
    const Camera camera = cameraAt(flight, kSeconds * (i + 0.5) / kDrawnPictures, fly);
    TERRANE_ASSIGN(const Cut first, terrain.selectAndLoad(camera, selection));
    TERRANE_TRY(terrain.draw(first, camera, style));
    for (int turn = 0; turn < kTimesDrawn; ++turn) {
      const std::clock_t begin = std::clock();
      const Cut cut = terrain.select(camera, selection);
      TERRANE_TRY(terrain.draw(cut, camera, style));
      const FrameReport& report = terrain.report();
      cpuMs.push_back(1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
      frameMs.push_back(report.selectMilliseconds + report.drawMilliseconds);
    }
    triangles += terrain.report().triangles;
    calls = std::max(calls, terrain.report().drawCalls);
    gpuBytes = std::max(gpuBytes, terrain.report().gpuBytes);
  }
  row["drawn_triangles"] = triangles / kDrawnPictures;
  row["draw_calls"] = calls;
  row["frame_ms"] = median(frameMs);
  row["frame_cpu_ms"] = median(cpuMs);
  row["gpu_mb"] = megabytes(gpuBytes);
  return {};
}

Status run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 3) return makeError("usage: measure_surfaces FLIGHT.json RESULT.json DATASET...");
  BenchResult result;
  result.bench = "surfaces";
  for (size_t i = 2; i < arguments.size(); ++i) {
    const std::string name = std::filesystem::path(arguments[i]).stem().string();
    for (const NamedSurface& of : kSurfaces) {
      // note: a terrain of its own, so that neither finds what the other has loaded.
      TERRANE_ASSIGN(const std::unique_ptr<Terrain> terrain,
                     Terrain::open(arguments[i], {.forceSoftware = true}));
      TERRANE_ASSIGN(const FittedFlight flight, readFlight(arguments[0], *terrain));
      nlohmann::ordered_json row{{"dataset", name}, {"surface", of.name}};
      double mostTriangles = 0.0;
      TERRANE_TRY(measureStream(*terrain, flight, of.surface, row, mostTriangles));
      TERRANE_TRY(measureDrawing(*terrain, flight, of.surface, row));
      std::fprintf(stderr, "%s, %s: %.0f triangles at most, %.1f MB, %.1f ms a frame\n", name.c_str(),
                   of.name, mostTriangles, row["mb"].get<double>(), row["frame_ms"].get<double>());
      if (of.surface == SurfaceKind::Meshes && name == kPageDataset)
        result.bars.push_back({"meshes_triangles_millions", 1e-6 * mostTriangles, "", 0.3});
      result.rows.push_back(std::move(row));
    }
  }
  return finishBench(result, arguments[1]);
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  return terrane::benchMain("measure_surfaces", argc, argv, terrane::run);
}
