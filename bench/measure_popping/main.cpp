#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <glm/geometric.hpp>
#include <limits>

#include "terrane/base/format_number.h"
#include "terrane/engine/read_flight.h"
#include "terrane/engine/terrain.h"
#include "terrane/lod/mesh_placement.h"
#include "terrane/measure/bench_result.h"
#include "terrane/measure/fly.h"
#include "terrane/measure/measure_pops.h"
#include "terrane/reference/load_reference.h"

/// How far points of the ground pop on screen from one frame to the next, everything resident, with morphing
/// and without, of both surfaces.
///
/// From each flight a few runs of neighbouring frames are taken, so far apart that the camera moves by 2 % of
/// the distance of the nearest ground in the picture from one to the next, however fast that makes the
/// flight; but at most a quarter of a second, and no farther than the camera turns by 0.02, which is as much
/// as that ground turns past a camera that moves so. One flight is measured turning by 5 degrees a frame as
/// well: no bar stands for that.
///
/// usage: measure_popping [--surface NAME] FLIGHTS-FOLDER RESULT.json DATASET...

namespace terrane {
namespace {

constexpr int kRunsPerFlight = 4;
constexpr int kFramesPerRun = 13;
constexpr double kMostSeconds = 0.25;
constexpr double kMostMoved = 0.02;
constexpr double kMostTurnedRadians = 0.02;
constexpr const char* kSpinningFlight = "hover_spin";
constexpr double kSpinRadians = 5.0 * 0.017453292519943295;
constexpr double kTauPixels = 1.0;

struct NamedSurface {
  const char* name;
  SurfaceKind surface;
};
constexpr NamedSurface kSurfaces[] = {{"patches", SurfaceKind::Patches}, {"meshes", SurfaceKind::Meshes}};

/// What one way to draw showed on one flight.
struct Seen {
  PopMeasure pops;
  ErrorMeasure error;
  CrackMeasure cracks;
  double triangles = 0.0;
  double worstSeconds = 0.0;  ///< when the largest pop was
};

double nearestGround(const Camera& camera, const std::vector<glm::dvec3>& places) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const glm::dvec3& place : places)
    if (!std::isnan(place.z)) nearest = std::min(nearest, glm::length(place - camera.eyeLocal));
  return nearest;
}

double turnedRadians(const Camera& a, const Camera& b) {
  return std::acos(std::clamp(glm::dot(a.forward, b.forward), -1.0, 1.0));
}

/// The time of the next frame.
double nextFrame(const FittedFlight& flight, double seconds, double nearest, double mostTurned,
                 const FlyOptions& options) {
  const Camera camera = cameraAt(flight, seconds, options);
  const auto isNear = [&](double step) {
    const Camera next = cameraAt(flight, seconds + step, options);
    return glm::length(next.eyeLocal - camera.eyeLocal) <= kMostMoved * nearest &&
           turnedRadians(next, camera) <= mostTurned;
  };
  double step = kMostSeconds;
  while (step > 1e-6 && !isNear(step)) step *= 0.97;
  return seconds + step;
}

class FlightMeasurement {
 public:
  FlightMeasurement(Terrain& terrain, const ReferenceSurface& truth, const FittedFlight& flight,
                    SurfaceKind surface, double mostTurned)
      : terrain_(terrain), truth_(truth), flight_(flight), surface_(surface), mostTurned_(mostTurned) {
    options_.width = 640;
    options_.height = 360;
    options_.tauPixels = kTauPixels;
  }

  /// Draws with morphing, which decides when the frames are, then the same frames without.
  Status measure() {
    for (int run = 0; run < kRunsPerFlight; ++run) {
      std::vector<double> times = {flight_.durationSeconds() * (run + 0.5) / kRunsPerFlight};
      TERRANE_TRY(measureRun(true, times, with));
      TERRANE_TRY(measureRun(false, times, without));
      seconds += times.back() - times.front();
      frames += static_cast<int64_t>(times.size());
    }
    return {};
  }

  Seen with;
  Seen without;
  double seconds = 0.0;
  int64_t frames = 0;
  double turned = 0.0;  ///< radians, at most from one frame to the next

 private:
  /// `times`: all of them, or only the first, to which the others are added.
  Status measureRun(bool morph, std::vector<double>& times, Seen& seen) {
    PatchSelection selection;
    selection.surface = surface_;
    selection.tolerancePixels = kTauPixels;
    selection.morph = morph;
    std::optional<Camera> lastCamera;
    std::unique_ptr<DrawnSurface> last;
    for (size_t frame = 0; frame < kFramesPerRun; ++frame) {
      const Camera camera = cameraAt(flight_, times[frame], options_);
      TERRANE_ASSIGN(const Cut cut, terrain_.selectAndLoad(camera, selection));
      TERRANE_ASSIGN(const PositionPicture picture, terrain_.drawPositions(cut, camera));
      seen.triangles += static_cast<double>(triangleCount(cut));
      auto surface =
          std::make_unique<DrawnSurface>(cut, terrain_.dataset().manifest().frame, terrain_.tiles());
      if (last) {
        const PopMeasure pops = measurePops({*lastCamera, *last}, {camera, *surface}, picture.local);
        if (pops.maxPixels > seen.pops.maxPixels) seen.worstSeconds = times[frame];
        seen.pops.add(pops);
      }
      if (frame % 6 == 0) {
        seen.error.add(measureError(truth_, camera, picture.local, kTauPixels));
        seen.cracks.add(measureCracks(truth_, camera, picture.local, kTauPixels));
      }
      if (times.size() < kFramesPerRun)
        times.push_back(
            nextFrame(flight_, times[frame], nearestGround(camera, picture.local), mostTurned_, options_));
      if (last) turned = std::max(turned, turnedRadians(*lastCamera, camera));
      lastCamera = camera;
      last = std::move(surface);
    }
    return {};
  }

  Terrain& terrain_;
  const ReferenceSurface& truth_;
  const FittedFlight& flight_;
  SurfaceKind surface_;
  double mostTurned_;
  FlyOptions options_;
};

Result<nlohmann::ordered_json> measureFlight(Terrain& terrain, const ReferenceSurface& truth,
                                             const FittedFlight& flight, SurfaceKind surface,
                                             double mostTurned) {
  FlightMeasurement measured(terrain, truth, flight, surface, mostTurned);
  TERRANE_TRY(measured.measure());
  const Seen& on = measured.with;
  const Seen& off = measured.without;
  return nlohmann::ordered_json{
      {"frames", measured.frames},
      {"seconds", measured.seconds},
      {"turned_degrees", measured.turned / 0.017453292519943295},
      {"max_pop_px", on.pops.maxPixels},
      {"p999_pop_px", on.pops.percentile999()},
      {"above_half_per_s", static_cast<double>(on.pops.aboveHalf) / measured.seconds},
      {"off_max_pop_px", off.pops.maxPixels},
      {"off_p999_pop_px", off.pops.percentile999()},
      {"off_above_half_per_s", static_cast<double>(off.pops.aboveHalf) / measured.seconds},
      {"max_error_over_tau", on.error.maxPixels / kTauPixels},
      {"off_max_error_over_tau", off.error.maxPixels / kTauPixels},
      {"rms_error_px", on.error.rms()},
      {"off_rms_error_px", off.error.rms()},
      {"cracks", on.cracks.cracks},
      {"missing", on.pops.missing + off.pops.missing},
      {"off_surface_px", std::max(on.pops.offSurface, off.pops.offSurface)},
      {"triangles", std::llround(on.triangles / static_cast<double>(measured.frames))},
      {"triangles_cost_percent", 100.0 * (on.triangles / off.triangles - 1.0)},
      {"worst_at_s", on.worstSeconds}};
}

/// Of all flights at their own pace.
struct Largest {
  double popPixels = 0.0;
  double p999PopPixels = 0.0;  ///< what 99.9 % of a flight's pixels stay below
};

Status measureDataset(const std::string& directory, const NamedSurface& of,
                      const std::vector<std::string>& paths, BenchResult& result, Largest& largest) {
  TERRANE_ASSIGN(const std::unique_ptr<Terrain> terrain, Terrain::open(directory));
  TERRANE_ASSIGN(const ReferenceSurface truth, loadReference(terrain->dataset()));
  for (const std::string& path : paths) {
    TERRANE_ASSIGN(const FittedFlight flight, readFlight(path, *terrain));
    const std::string name = std::filesystem::path(path).stem().string();
    for (const bool spins : {false, true}) {
      if (spins && name != kSpinningFlight) continue;
      TERRANE_ASSIGN(const auto measured, measureFlight(*terrain, truth, flight, of.surface,
                                                        spins ? kSpinRadians : kMostTurnedRadians));
      auto row = nlohmann::ordered_json{{"dataset", std::filesystem::path(directory).stem().string()},
                                        {"surface", of.name},
                                        {"flight", spins ? name + ", 5 degrees" : name}};
      row.update(measured);
      std::fprintf(stderr, "%s, %s, %s: popped by at most %.3f pixels, without morphing %.3f\n",
                   directory.c_str(), of.name, row["flight"].get<std::string>().c_str(),
                   row["max_pop_px"].get<double>(), row["off_max_pop_px"].get<double>());
      if (!spins) {
        largest.popPixels = std::max(largest.popPixels, row["max_pop_px"].get<double>());
        largest.p999PopPixels = std::max(largest.p999PopPixels, row["p999_pop_px"].get<double>());
      }
      result.rows.push_back(std::move(row));
    }
  }
  return {};
}

Status run(const std::vector<std::string>& given) {
  std::vector<std::string> arguments = given;
  std::string only;
  if (arguments.size() > 2 && arguments[0] == "--surface") {
    only = arguments[1];
    arguments.erase(arguments.begin(), arguments.begin() + 2);
  }
  const bool isKnown = only.empty() || std::any_of(std::begin(kSurfaces), std::end(kSurfaces),
                                                   [&](const auto& each) { return only == each.name; });
  if (arguments.size() < 3 || !isKnown)
    return makeError(
        "usage: measure_popping [--surface patches|meshes] FLIGHTS-FOLDER RESULT.json DATASET...");
  TERRANE_ASSIGN(const std::vector<std::string> flights, flightsIn(arguments[0]));

  BenchResult result;
  result.bench = "popping";
  for (const NamedSurface& of : kSurfaces) {
    if (!only.empty() && only != of.name) continue;
    Largest largest;
    for (size_t i = 2; i < arguments.size(); ++i)
      TERRANE_TRY(measureDataset(arguments[i], of, flights, result, largest));
    // note: along the sides of meshes triangles are other ones from level to level, and a few pixels pop
    // there.
    if (of.surface == SurfaceKind::Patches)
      result.bars.push_back({"max_pop_px", largest.popPixels, "pixels", 0.5});
    else
      result.bars.push_back({"meshes_p999_pop_px", largest.p999PopPixels, "pixels", 0.1});
  }
  const auto largestOf = [&](const char* member) {
    double value = 0.0;
    for (const auto& row : result.rows) value = std::max(value, row[member].get<double>());
    return value;
  };
  result.bars.push_back({"max_error_over_tau", largestOf("max_error_over_tau"), "", 1.0});
  result.bars.push_back({"cracks", largestOf("cracks"), "pixels", 0.0});
  result.bars.push_back({"missing", largestOf("missing"), "pixels", 0.0});
  return finishBench(result, arguments[1]);
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  return terrane::benchMain("measure_popping", argc, argv, terrane::run);
}
