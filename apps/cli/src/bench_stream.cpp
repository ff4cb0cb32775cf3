#include "bench_stream.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <span>
#include <utility>

#include "terrane/gpu/context.h"
#include "terrane/reference/load_reference.h"

namespace terrane::cli {

namespace {

/// A number with one of these units behind it, in terms of what they are factors of; negative if it is none.
double numberWithUnit(const std::string& text, std::span<const std::pair<const char*, double>> units) {
  char* rest = nullptr;
  const double number = std::strtod(text.c_str(), &rest);
  if (rest == text.c_str() || !std::isfinite(number)) return -1.0;
  for (const auto& [unit, factor] : units)
    if (std::string(rest) == unit) return number * factor;
  return -1.0;
}

}  // namespace

Result<LineModel> parseLine(const std::string& text) {
  constexpr std::array<std::pair<const char*, double>, 7> kRates = {{{"bit/s", 0.125},
                                                                     {"kbit/s", 125.0},
                                                                     {"Mbit/s", 125e3},
                                                                     {"Gbit/s", 125e6},
                                                                     {"B/s", 1.0},
                                                                     {"kB/s", 1e3},
                                                                     {"MB/s", 1e6}}};
  constexpr std::array<std::pair<const char*, double>, 2> kTimes = {{{"ms", 1e-3}, {"s", 1.0}}};
  const size_t comma = text.find(',');
  const double rate = numberWithUnit(text.substr(0, comma), kRates);
  const double latency = comma == std::string::npos ? -1.0 : numberWithUnit(text.substr(comma + 1), kTimes);
  if (!(rate >= 1.0 && rate <= 1e12 && latency >= 0.0 && latency <= 60.0))
    return makeError("--line {}: expected how fast and how late, such as 40Mbit/s,50ms or 500kB/s,0.2s",
                     text);
  return LineModel{rate, latency};
}

Result<StreamBenchResult> flyStreamBench(const StreamBench& bench, Terrain& terrain, Progress& progress) {
  StreamBenchResult out;
  StreamFlightOptions& options = out.options;
  options.line = bench.line;
  options.view.selection = bench.selection;
  options.view.policy = bench.policy;
  options.view.neededTiles = neededTilesOf(terrain);
  options.width = bench.fly.width;
  options.height = bench.fly.height;
  options.framesPerSecond = bench.fly.framesPerSecond;
  options.durationSeconds = bench.flight.durationSeconds();
  options.draw = bench.reference != nullptr;
  options.errorEvery = static_cast<int>(std::min<int64_t>(bench.fly.referenceEvery, 1000000));

  std::unique_ptr<gpu::Context> context;
  std::optional<ReferenceSurface::Cover> cover;
  std::optional<StreamTruth> truth;
  if (options.draw) {
    TERRANE_ASSIGN(context, gpu::Context::createHeadless({.forceSoftware = bench.forceSoftware}));
    out.rendererName = context->rendererName();
    cover.emplace(*bench.reference, coarsestCellMargin(terrain.dataset().manifest().frame));
    truth.emplace(StreamTruth{*bench.reference, *cover});
  }
  const auto camera = [&](double seconds) { return cameraAt(bench.flight, seconds, bench.fly); };
  TERRANE_ASSIGN(out.report, flyStream(bench.dataset, camera, truth ? &*truth : nullptr, context.get(),
                                       options, progress));
  return out;
}

}  // namespace terrane::cli
