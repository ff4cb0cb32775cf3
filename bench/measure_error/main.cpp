#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "terrane/base/format_number.h"
#include "terrane/engine/read_flight.h"
#include "terrane/measure/bench_result.h"
#include "terrane/measure/fly.h"
#include "terrane/reference/load_reference.h"
#include "terrane/scene/terrain_scene.h"

/// The largest error on screen that pictures of `patches` have, and their cracks, over tau, K and field of
/// view: pictures at moments of every flight, held against the full-resolution surface, and pictures at
/// random moments of loading.
///
/// usage: measure_error [--surface patches|meshes] FLIGHTS-FOLDER RESULT.json DATASET...

namespace terrane {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 360;
/// Ways to make triangles of tiles.
struct MeasuredSurface {
  const char* name;
  SurfaceKind kind;
  int k;
};
constexpr MeasuredSurface kSurfaces[] = {{"patches, K 17", SurfaceKind::Patches, 4},
                                         {"patches, K 33", SurfaceKind::Patches, 5},
                                         {"meshes", SurfaceKind::Meshes, 4}};
constexpr int kMomentsPerFlight = 3;
constexpr int kLoadingMoments = 6;
/// Flights that stay above the highest ground, where a crack while loading can be told.
constexpr const char* kLoadingFlights[] = {"p2_straight", "p5_turnover"};

/// The truth about a dataset.
struct Truth {
  ReferenceSurface surface;
  ReferenceSurface::Cover cover;
  explicit Truth(ReferenceSurface&& loaded, const Frame& frame)
      : surface(std::move(loaded)), cover(surface, coarsestCellMargin(frame)) {}
  Truth(const Truth&) = delete;
  Truth& operator=(const Truth&) = delete;
};

struct NamedFlight {
  std::string name;
  FittedFlight flight;
};

/// One way to draw, measured over all flights: a row.
Result<FlightReport> measureSetting(Terrain& terrain, const Truth& truth,
                                    const std::vector<NamedFlight>& flights, const PatchSelection& selection,
                                    const FlyOptions& options, std::string& worst) {
  TerrainScene scene(terrain, selection);
  FlightReport report;
  for (const NamedFlight& named : flights) {
    for (int moment = 0; moment < kMomentsPerFlight; ++moment) {
      const double seconds = named.flight.durationSeconds() * (moment + 0.5) / kMomentsPerFlight;
      const Camera camera = cameraAt(named.flight, seconds, options);
      TERRANE_TRY(scene.loadAll(camera));
      TERRANE_ASSIGN(const auto places, scene.places(camera));
      const ErrorMeasure error = measureError(truth.surface, camera, places, options.tauPixels);
      if (error.maxPixels > report.error.maxPixels)
        worst = fmt::format("{} at {:.2f} s", named.name, seconds);
      report.error.add(error);
      report.cracks.add(measureCracks(truth.surface, camera, places, options.tauPixels));
    }
  }

  // Loading comes last: it forgets the tiles.
  for (const NamedFlight& named : flights) {
    if (std::none_of(std::begin(kLoadingFlights), std::end(kLoadingFlights),
                     [&](const char* name) { return named.name == name; })) {
      continue;
    }
    const double seconds = 0.4 * named.flight.durationSeconds();
    TERRANE_ASSIGN(
        const CrackMeasure cracks,
        measureLoading(scene, cameraAt(named.flight, seconds, options), truth.cover, kLoadingMoments,
                       options.seed + report.error.pixels % 1000, report.loadingPictures));
    report.loading.add(cracks);
  }
  return report;
}

Status measureDataset(const std::string& directory, const std::vector<std::string>& paths,
                      const std::string& only, BenchResult& result) {
  TERRANE_ASSIGN(const std::unique_ptr<Terrain> terrain, Terrain::open(directory));
  TERRANE_ASSIGN(ReferenceSurface surface, loadReference(terrain->dataset()));
  const Truth truth(std::move(surface), terrain->dataset().manifest().frame);
  std::vector<NamedFlight> flights;
  for (const std::string& path : paths) {
    TERRANE_ASSIGN(FittedFlight flight, readFlight(path, *terrain));
    flights.push_back({std::filesystem::path(path).stem().string(), std::move(flight)});
  }

  const std::string name = std::filesystem::path(directory).stem().string();
  for (const auto& [drawn, kind, k] : kSurfaces) {
    if (std::string_view(drawn).substr(0, only.size()) != only) continue;
    const bool isMeshes = kind == SurfaceKind::Meshes;
    for (const double tau : isMeshes ? std::vector{2.0 / 3.0, 1.0} : std::vector{1.0, 2.0}) {
      for (const double fovy : {45.0, 90.0}) {
        PatchSelection selection;
        selection.surface = kind;
        selection.grid.k = k;
        selection.tolerancePixels = tau;
        FlyOptions options;
        options.width = kWidth;
        options.height = kHeight;
        options.tauPixels = tau;
        options.fovyDegrees = fovy;
        std::string worst;
        TERRANE_ASSIGN(const FlightReport report,
                       measureSetting(*terrain, truth, flights, selection, options, worst));
        result.rows.push_back({{"dataset", name},
                               {"surface", drawn},
                               {"tau", tau},
                               {"fovy", fovy},
                               {"max_error_over_tau", report.error.maxPixels / tau},
                               {"p999_px", report.error.percentile999()},
                               {"rms_px", report.error.rms()},
                               {"worst", worst},
                               {"pixels", report.error.pixels},
                               {"cracks", report.cracks.cracks},
                               {"see_through", report.cracks.seeThrough},
                               {"loading_pictures", report.loadingPictures},
                               {"loading_pixels", report.loading.checked},
                               {"loading_cracks", report.loading.cracks}});
        std::fprintf(
            stderr, "%s: %s, tau %.3g, fovy %g: largest error %.3f tau, %lld cracks, %lld while loading\n",
            name.c_str(), drawn, tau, fovy, report.error.maxPixels / tau,
            static_cast<long long>(report.cracks.cracks), static_cast<long long>(report.loading.cracks));
      }
    }
  }
  return {};
}

Status run(std::vector<std::string> arguments) {
  std::string only;
  if (arguments.size() > 2 && arguments[0] == "--surface") {
    only = arguments[1];
    arguments.erase(arguments.begin(), arguments.begin() + 2);
  }
  if (arguments.size() < 3 || (!only.empty() && only != "patches" && only != "meshes"))
    return makeError("usage: measure_error [--surface patches|meshes] FLIGHTS-FOLDER RESULT.json DATASET...");
  TERRANE_ASSIGN(const std::vector<std::string> flights, flightsIn(arguments[0]));

  BenchResult result;
  result.bench = "error";
  for (size_t i = 2; i < arguments.size(); ++i)
    TERRANE_TRY(measureDataset(arguments[i], flights, only, result));

  const auto largest = [&](const char* member) {
    double value = 0.0;
    for (const auto& row : result.rows) value = std::max(value, row[member].get<double>());
    return value;
  };
  const auto sum = [&](const char* member) {
    double value = 0.0;
    for (const auto& row : result.rows) value += row[member].get<double>();
    return value;
  };
  // note: see_through stands in the table but is no bar: behind a crest that is lower by what tau allows, a
  // pixel now and then shows ground that the true crest hides.
  result.bars = {{"max_error_over_tau", largest("max_error_over_tau"), "", 1.0},
                 {"cracks_resident", sum("cracks"), "pixels", 0.0},
                 {"cracks_loading", sum("loading_cracks"), "pixels", 0.0}};
  return finishBench(result, arguments[1]);
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  return terrane::benchMain("measure_error", argc, argv, terrane::run);
}
