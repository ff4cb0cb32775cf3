#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <glm/trigonometric.hpp>
#include <map>
#include <tuple>

#include "terrane/engine/read_flight.h"
#include "terrane/measure/bench_result.h"
#include "terrane/measure/fly.h"
#include "terrane/reference/load_reference.h"
#include "terrane/scene/stream_flight.h"

/// Streaming over a simulated line, in simulated time: a flight under three policies, with small caches,
/// after a teleport, over a very thin line, and with faults.
///
/// usage: measure_stream [--only SETTING] FLIGHT.json RESULT.json DATASET...

namespace terrane {
namespace {

constexpr double kMegabit = 1e6 / 8.0;
constexpr LineModel kLine{40.0 * kMegabit, 0.05};
constexpr LineModel kSlowLine{1.0 * kMegabit, 0.1};
constexpr LineModel kThinLine{3000.0, 0.05};
constexpr double kFlightSeconds = 10.0;
/// After a teleport a coarse picture must be complete within these.
constexpr double kCoarseSeconds = 0.5;
constexpr uint64_t kCoarseBytes = 300000;

double kilobytes(uint64_t bytes) {
  return static_cast<double>(bytes) / 1e3;
}

enum class Stand : uint8_t {
  Flies,
  Teleported,  ///< still, in the middle of the flight, where nothing has come before
  Overview,    ///< still, all of the ground in view: a dataset that is just being opened
};

struct Setting {
  const char* name;
  StreamFlightOptions options;
  Stand stand = Stand::Flies;
};

struct Ground {
  const std::string& directory;
  const ReferenceSurface& surface;
  const ReferenceSurface::Cover& cover;
  const FittedFlight& flight;
  GroundBox box;
};

std::vector<Setting> settings(Terrain& terrain) {
  std::vector<Setting> out;
  StreamFlightOptions base;
  base.line = kLine;
  base.durationSeconds = kFlightSeconds;
  base.view.neededTiles = neededTilesOf(terrain);
  // What is wished for, and by how much it matters, needs no picture.
  StreamFlightOptions counted = base;
  counted.width = 1280;
  counted.height = 720;
  counted.draw = false;
  out.push_back({"available", counted});
  for (const auto& [name, policy] : {std::pair{"progressive", StreamPolicy::Progressive},
                                     std::pair{"all-at-once", StreamPolicy::AllAtOnce}}) {
    out.push_back({name, counted});
    out.back().options.view.policy = policy;
  }
  out.push_back({"drawn", base});
  out.push_back({"slow_line", base});
  out.back().options.line = kSlowLine;
  out.back().options.view.selection.surface = SurfaceKind::Meshes;
  out.push_back({"small_caches", base});
  ViewOptions& small = out.back().options.view;
  small.gpuGeometryBytes = small.stream.decodedBytes = 2U << 20;
  small.gpuTextureBytes = small.stream.pictureBytes = 4U << 20;
  out.push_back({"faults", base});
  LineFaults& faults = out.back().options.faults;
  faults.busyShare = faults.slowShare = faults.truncatedShare = faults.corruptShare = 0.025;
  faults.outages = {{4.0, 5.5}};
  base.begunAtRest = false;
  out.push_back({"teleport", base, Stand::Teleported});
  out.back().options.durationSeconds = 1.0;
  out.back().options.errorEvery = 1;
  out.back().options.pictureSeconds = {0.1, 0.25, 0.5, 1.0};
  base.line = kThinLine;
  base.durationSeconds = 30.0;
  base.framesPerSecond = 10.0;
  base.pictureSeconds = {2.5, 5.0, 10.0, 30.0};
  out.push_back({"thin_line", base, Stand::Overview});
  out.push_back({"thin_line_near", base, Stand::Teleported});
  return out;
}

/// When the ground first shows; without that a frame that never came.
const StreamFlightFrame& firstGround(const StreamFlightReport& report) {
  static const StreamFlightFrame never = [] {
    StreamFlightFrame frame;
    frame.seconds = 1e9;
    return frame;
  }();
  const auto found = std::find_if(report.frames.begin(), report.frames.end(),
                                  [](const auto& frame) { return frame.groundPixels > 0; });
  return found == report.frames.end() ? never : *found;
}

/// The last frame within so much time and so many bytes whose error was measured.
const StreamFlightFrame& lastBefore(const StreamFlightReport& report, double seconds, uint64_t bytes) {
  const StreamFlightFrame* out = &report.frames.front();
  for (const StreamFlightFrame& frame : report.frames)
    if (frame.seconds <= seconds + 1e-9 && frame.bytes <= bytes && frame.p999Pixels >= 0.0) out = &frame;
  return *out;
}

/// The largest value of each name.
struct Worst {
  std::map<std::string, double> values;
  void add(const std::string& name, double value) {
    const auto [at, isNew] = values.emplace(name, value);
    if (!isNew) at->second = std::max(at->second, value);
  }
};

Result<StreamFlightReport> measure(const Ground& ground, const Setting& setting, gpu::Context& context,
                                   BenchResult& result) {
  const StreamFlightOptions& options = setting.options;
  FlyOptions fly;
  fly.width = options.width;
  fly.height = options.height;
  const double middle = 0.5 * ground.flight.durationSeconds();
  const auto camera = [&](double seconds) {
    if (setting.stand == Stand::Overview)
      return overviewCamera(ground.box, 180.0, 32.0, glm::radians(45.0), fly.width, fly.height);
    return cameraAt(ground.flight, setting.stand == Stand::Flies ? seconds : middle, fly);
  };
  const StreamTruth truth{ground.surface, ground.cover};
  SilentProgress silent;
  TERRANE_ASSIGN(StreamFlightReport report,
                 flyStream(ground.directory, camera, &truth, &context, options, silent));

  const StreamFlightSummary last = summaryOf(report);
  const StreamFlightFrame& first = firstGround(report);
  const StreamFlightFrame& coarse = lastBefore(report, kCoarseSeconds, kCoarseBytes);
  result.rows.push_back({{"dataset", std::filesystem::path(ground.directory).stem().string()},
                         {"setting", setting.name},
                         {"debt_px_s", report.debtPixelSeconds},
                         {"true_px_s", report.excessPixelSeconds},
                         {"cracks", report.cracks},
                         {"crack_pixels", report.crackPixels},
                         {"frames_until_used", report.framesUntilUsed},
                         {"first_s", first.seconds},
                         {"first_kb", kilobytes(first.bytes)},
                         {"coarse_s", coarse.seconds},
                         {"coarse_kb", kilobytes(coarse.bytes)},
                         {"coarse_p999_px", coarse.p999Pixels},
                         {"p999_half_s", lastBefore(report, kCoarseSeconds, UINT64_MAX).p999Pixels},
                         {"p999_end", report.frames.back().p999Pixels},
                         {"requests", last.stream.requests},
                         {"mb", static_cast<double>(last.stream.bytesReceived) / 1e6},
                         {"mb_unwanted", static_cast<double>(last.stream.bytesUnwanted) / 1e6},
                         {"failed", last.stream.requestsFailed},
                         {"lost", last.stream.tilesLost},
                         {"loosest", last.loosest},
                         {"memory_factor", last.memoryFactor}});
  std::fprintf(stderr, "%s, %s: debt %.0f px s, %lld cracks in %lld pixels, used after %d frames, %.1f MB\n",
               ground.directory.c_str(), setting.name, report.debtPixelSeconds,
               static_cast<long long>(report.cracks), static_cast<long long>(report.crackPixels),
               report.framesUntilUsed, static_cast<double>(last.stream.bytesReceived) / 1e6);
  return report;
}

Status run(const std::vector<std::string>& given) {
  std::vector<std::string> arguments = given;
  std::string only;
  if (arguments.size() > 2 && arguments[0] == "--only") {
    only = arguments[1];
    arguments.erase(arguments.begin(), arguments.begin() + 2);
  }
  if (arguments.size() < 3)
    return makeError("usage: measure_stream [--only SETTING] FLIGHT.json RESULT.json DATASET...");
  const std::filesystem::path pictures = std::filesystem::path(arguments[1]).replace_extension();
  std::filesystem::create_directories(pictures);
  BenchResult result;
  result.bench = "stream";
  TERRANE_ASSIGN(const std::unique_ptr<gpu::Context> context,
                 gpu::Context::createHeadless({.forceSoftware = true}));
  Worst worst;
  for (size_t i = 2; i < arguments.size(); ++i) {
    TERRANE_ASSIGN(const std::unique_ptr<Terrain> terrain, Terrain::open(arguments[i]));
    TERRANE_ASSIGN(const ReferenceSurface surface, loadReference(terrain->dataset()));
    TERRANE_ASSIGN(const FittedFlight flight, readFlight(arguments[0], *terrain));
    const ReferenceSurface::Cover cover(surface, coarsestCellMargin(terrain->dataset().manifest().frame));
    const Ground ground{arguments[i], surface, cover, flight, terrain->groundBox()};
    double debt = -1.0;
    for (Setting& setting : settings(*terrain)) {
      if (!only.empty() && only != setting.name) continue;
      setting.options.picturePrefix =
          (pictures / fmt::format("{}_{}", std::filesystem::path(arguments[i]).stem().string(), setting.name))
              .string();
      TERRANE_ASSIGN(const StreamFlightReport report, measure(ground, setting, *context, result));
      const std::string name = setting.name;
      worst.add("cracks", static_cast<double>(report.cracks));
      if (name == "available") {
        debt = report.debtPixelSeconds;
        worst.add("frames_until_used", report.framesUntilUsed);
        worst.add("debt", debt);
      }
      if (name == "progressive" && debt >= 0.0)
        worst.add("debt_vs_progressive", debt / report.debtPixelSeconds);
      if (name == "all-at-once" && debt >= 0.0)
        worst.add("debt_vs_all_at_once", debt / report.debtPixelSeconds);
      if (name == "teleport") {
        const StreamFlightFrame& coarse = lastBefore(report, kCoarseSeconds, kCoarseBytes);
        worst.add("teleport_p999_px", coarse.groundPixels > 0 ? coarse.p999Pixels : 1e9);
      }
      if (name == "thin_line") worst.add("thin_line_first_s", firstGround(report).seconds);
    }
  }
  for (const auto& [name, unit, most] : std::initializer_list<std::tuple<const char*, const char*, double>>{
           {"cracks", "pixels", 0.0},
           {"frames_until_used", "frames", 2.0},
           {"debt", "px s", 3400.0},
           {"debt_vs_progressive", "", 0.7},
           {"debt_vs_all_at_once", "", 0.5},
           {"teleport_p999_px", "px", 8.0},
           {"thin_line_first_s", "s", 5.0}}) {
    if (worst.values.count(name) != 0) result.bars.push_back({name, worst.values[name], unit, most});
  }
  return finishBench(result, arguments[1]);
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  return terrane::benchMain("measure_stream", argc, argv, terrane::run);
}
