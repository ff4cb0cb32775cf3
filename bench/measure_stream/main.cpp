#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "terrane/engine/read_flight.h"
#include "terrane/measure/bench_result.h"
#include "terrane/measure/fly.h"
#include "terrane/reference/load_reference.h"
#include "terrane/scene/stream_flight.h"

/// Streaming over a simulated line, in simulated time: a flight under three policies, with small caches, after
/// a teleport, over a very thin line, and with faults.
///
/// usage: measure_stream FLIGHT.json RESULT.json DATASET...

namespace terrane {
namespace {

constexpr double kMegabit = 1e6 / 8.0;
constexpr LineModel kLine{40.0 * kMegabit, 0.05};
constexpr LineModel kThinLine{3000.0, 0.05};
constexpr double kFlightSeconds = 10.0;

struct Setting {
  const char* name;
  StreamFlightOptions options;
  bool standsStill = false;  ///< as after a teleport
};

struct Ground {
  const std::string& directory;
  const ReferenceSurface& surface;
  const ReferenceSurface::Cover& cover;
  const FittedFlight& flight;
};

std::vector<Setting> settings(Terrain& terrain) {
  std::vector<Setting> out;
  StreamFlightOptions base;
  base.line = kLine;
  base.durationSeconds = kFlightSeconds;
  base.view.neededTiles = neededTilesOf(terrain);
  out.push_back({"available", base});
  for (const auto& [name, policy] : {std::pair{"progressive", StreamPolicy::Progressive},
                                     std::pair{"all-at-once", StreamPolicy::AllAtOnce}}) {
    out.push_back({name, base});
    out.back().options.view.policy = policy;
  }
  if (getenv("ONLY")) return out;
  out.push_back({"small caches", base});
  ViewOptions& small = out.back().options.view;
  small.gpuGeometryBytes = small.stream.decodedBytes = 2U << 20;
  small.gpuTextureBytes = small.stream.pictureBytes = 4U << 20;
  out.push_back({"faults", base});
  LineFaults& faults = out.back().options.faults;
  faults.busyShare = faults.slowShare = faults.truncatedShare = faults.corruptShare = 0.025;
  faults.outages = {{4.0, 5.5}};
  base.begunAtRest = false;
  out.push_back({"teleport", base, true});
  out.back().options.durationSeconds = 1.0;
  out.push_back({"thin line", base, true});
  out.back().options.line = kThinLine;
  out.back().options.durationSeconds = 6.0;
  out.back().options.framesPerSecond = 30.0;
  return out;
}

Result<StreamFlightReport> measure(const Ground& ground, const Setting& setting, gpu::Context& context,
                                   BenchResult& result) {
  const StreamFlightOptions& options = setting.options;
  FlyOptions fly;
  fly.width = options.width;
  fly.height = options.height;
  const double middle = 0.5 * ground.flight.durationSeconds();
  const auto camera = [&](double seconds) {
    return cameraAt(ground.flight, setting.standsStill ? middle : seconds, fly);
  };
  const StreamTruth truth{ground.surface, ground.cover};
  TERRANE_ASSIGN(StreamFlightReport report, flyStream(ground.directory, camera, &truth, &context, options));

  const ViewReport& last = report.frames.back().view;
  double loosest = 1.0, memory = 1.0;
  for (const StreamFlightFrame& frame : report.frames) {
    loosest = std::max(loosest, frame.view.stream.looseness);
    memory = std::max(memory, frame.view.memoryFactor);
  }
  // When the picture first covers the view, and how good it is half a second in.
  const auto at = [&](double seconds) -> const StreamFlightFrame& {
    const auto found = std::find_if(report.frames.begin(), report.frames.end(), [&](const auto& frame) {
      return frame.seconds >= seconds - 1e-9 && frame.p999Pixels >= 0.0;
    });
    return found == report.frames.end() ? report.frames.back() : *found;
  };
  const auto first = std::find_if(report.frames.begin(), report.frames.end(),
                                  [](const auto& frame) { return frame.groundPixels > 0; });
  const double firstSeconds = first == report.frames.end() ? 1e9 : first->seconds;
  result.rows.push_back({{"dataset", std::filesystem::path(ground.directory).stem().string()},
                         {"setting", setting.name},
                         {"debt_px_s", report.debtPixelSeconds},
                         {"cracks", report.cracks},
                         {"crack_pixels", report.crackPixels},
                         {"frames_until_used", report.framesUntilUsed},
                         {"first_s", firstSeconds},
                         {"p999_half_s", at(0.5).p999Pixels},
                         {"mb_half_s", static_cast<double>(at(0.5).view.stream.bytesReceived) / 1e6},
                         {"p999_end", report.frames.back().p999Pixels},
                         {"requests", last.stream.requests},
                         {"mb", static_cast<double>(last.stream.bytesReceived) / 1e6},
                         {"mb_unwanted", static_cast<double>(last.stream.bytesUnwanted) / 1e6},
                         {"failed", last.stream.requestsFailed},
                         {"lost", last.stream.tilesLost},
                         {"loosest", loosest},
                         {"memory_factor", memory}});
  std::fprintf(stderr, "%s, %s: debt %.0f px s, %lld cracks in %lld pixels, used after %d frames, %.1f MB\n",
               ground.directory.c_str(), setting.name, report.debtPixelSeconds,
               static_cast<long long>(report.cracks), static_cast<long long>(report.crackPixels),
               report.framesUntilUsed, static_cast<double>(last.stream.bytesReceived) / 1e6);
  return report;
}

Status run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 3) return makeError("usage: measure_stream FLIGHT.json RESULT.json DATASET...");
  BenchResult result;
  result.bench = "stream";
  TERRANE_ASSIGN(const std::unique_ptr<gpu::Context> context,
                 gpu::Context::createHeadless({.forceSoftware = true}));
  double progressive = 0.0, allAtOnce = 0.0;
  int64_t cracks = 0;
  int framesUntilUsed = 0;
  for (size_t i = 2; i < arguments.size(); ++i) {
    TERRANE_ASSIGN(const std::unique_ptr<Terrain> terrain, Terrain::open(arguments[i]));
    TERRANE_ASSIGN(const ReferenceSurface surface, loadReference(terrain->dataset()));
    TERRANE_ASSIGN(const FittedFlight flight, readFlight(arguments[0], *terrain));
    const ReferenceSurface::Cover cover(surface, coarsestCellMargin(terrain->dataset().manifest().frame));
    const Ground ground{arguments[i], surface, cover, flight};
    double debt = 0.0;
    for (const Setting& setting : settings(*terrain)) {
      TERRANE_ASSIGN(const StreamFlightReport report, measure(ground, setting, *context, result));
      const std::string name = setting.name;
      cracks += report.cracks;
      if (name == "available") {
        debt = report.debtPixelSeconds;
        framesUntilUsed = std::max(framesUntilUsed, report.framesUntilUsed);
      }
      if (name == "progressive") progressive = std::max(progressive, debt / report.debtPixelSeconds);
      if (name == "all-at-once") allAtOnce = std::max(allAtOnce, debt / report.debtPixelSeconds);
    }
  }
  result.bars = {{"cracks", static_cast<double>(cracks), "pixels", 0.0},
                 {"frames_until_used", static_cast<double>(framesUntilUsed), "frames", 2.0},
                 {"debt_vs_progressive", progressive, "", 0.7},
                 {"debt_vs_all_at_once", allAtOnce, "", 0.5}};
  std::fputs(result.toTable().c_str(), stdout);
  TERRANE_TRY(writeTextFile(arguments[1], result.toJson().dump(1) + "\n"));
  return result.allHold() ? Status() : Status(makeError("a bar does not hold"));
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  const terrane::Status done = terrane::run(std::vector<std::string>(argv + 1, argv + argc));
  if (done.ok()) return 0;
  std::fprintf(stderr, "measure_stream: %s\n", done.error().message.c_str());
  return 1;
}
