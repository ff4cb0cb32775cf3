#include <cstdio>
#include <filesystem>
#include <map>

#include "terrane/base/format_number.h"
#include "terrane/engine/read_flight.h"
#include "terrane/measure/bench_result.h"
#include "terrane/measure/fly.h"
#include "terrane/measure/grid_tiles.h"
#include "terrane/scene/terrain_scene.h"

/// Triangles of `patches` against a uniform grid-per-tile level of detail: the same data, flights, cameras
/// and tolerance. Selection alone, nothing is drawn.
///
/// usage: measure_patches FLIGHTS-FOLDER RESULT.json DATASET...

namespace terrane {
namespace {

constexpr int kFramesPerFlight = 40;
constexpr double kTauPixels = 1.0;
constexpr double kBar = 0.30;

struct Sums {
  double patchTriangles = 0.0;
  double gridTriangles = 0.0;
  double ratio() const { return gridTriangles > 0.0 ? patchTriangles / gridTriangles : 0.0; }
};

Status measureDataset(const std::string& directory, const std::vector<std::string>& flights,
                      BenchResult& result, std::map<int, Sums>& total) {
  TERRANE_ASSIGN(const std::unique_ptr<Terrain> terrain, Terrain::open(directory));
  TERRANE_ASSIGN(const AllTiles tiles, AllTiles::load(terrain->dataset()));
  const Manifest& manifest = terrain->dataset().manifest();
  FlyOptions options;
  options.frames = kFramesPerFlight;
  for (const std::string& path : flights) {
    TERRANE_ASSIGN(const FittedFlight flight, readFlight(path, *terrain));
    const std::vector<double> times = frameTimes(flight.durationSeconds(), options);
    nlohmann::ordered_json row = {{"dataset", std::filesystem::path(directory).stem().string()},
                                  {"flight", std::filesystem::path(path).stem().string()}};

    // The grids first, then every K; means over the frames.
    double grid = 0.0;
    for (const double time : times) {
      const Camera camera = cameraAt(flight, time, options);
      grid += static_cast<double>(
          selectGridTiles(tiles, manifest.frame, manifest.scale, camera, kTauPixels).triangles);
    }
    row["grid"] = static_cast<int64_t>(grid / static_cast<double>(times.size()));
    double best = 0.0;
    for (int k = 2; k <= PatchGrid::kLargest; ++k) {
      PatchSelection selection;
      selection.grid.k = k;
      selection.tolerancePixels = kTauPixels;
      double patches = 0.0;
      for (const double time : times) {
        const Cut cut =
            selectPatches(selection, manifest.frame, manifest.scale, cameraAt(flight, time, options), tiles);
        patches += static_cast<double>(cut.patches.size()) * selection.grid.trianglesPerPatch();
      }
      total[selection.grid.samplesPerSide()].patchTriangles += patches;
      total[selection.grid.samplesPerSide()].gridTriangles += grid;
      row[fmt::format("K={}", selection.grid.samplesPerSide())] =
          static_cast<int64_t>(patches / static_cast<double>(times.size()));
      const double ratio = grid > 0.0 ? patches / grid : 0.0;
      best = k == 2 ? ratio : std::min(best, ratio);
    }
    row["best_ratio"] = best;
    result.rows.push_back(row);
  }
  return {};
}

Status run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 3) return makeError("usage: measure_patches FLIGHTS-FOLDER RESULT.json DATASET...");
  TERRANE_ASSIGN(const std::vector<std::string> flights, flightsIn(arguments[0]));

  BenchResult result;
  result.bench = "patches";
  std::map<int, Sums> total;
  for (size_t i = 2; i < arguments.size(); ++i) {
    std::fprintf(stderr, "%s\n", arguments[i].c_str());
    TERRANE_TRY(measureDataset(arguments[i], flights, result, total));
  }

  // One K for everything: the best over all flights and datasets.
  int bestK = total.begin()->first;
  for (const auto& [k, sums] : total) {
    std::printf("K = %3d: %.3f of the triangles of the grids\n", k, sums.ratio());
    if (sums.ratio() < total[bestK].ratio()) bestK = k;
  }
  std::printf("The best K is %d.\n\n", bestK);
  result.bars.push_back({"triangles_vs_grid", total[bestK].ratio(), "", kBar});
  return finishBench(result, arguments[1], {{"best_k", bestK}});
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  return terrane::benchMain("measure_patches", argc, argv, terrane::run);
}
