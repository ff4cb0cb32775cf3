#include <algorithm>
#include <cmath>
#include <numeric>

#include "terrane/base/format_number.h"
#include "terrane/measure/bench_result.h"
#include "terrane/measure/fly.h"

namespace terrane {
namespace {

using Json = nlohmann::ordered_json;

/// The value that `share` of the values do not exceed (nearest rank); 0 of none.
double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const double rank = std::ceil(share * static_cast<double>(values.size())) - 1.0;
  return values[static_cast<size_t>(std::max(0.0, rank))];
}

double mean(const std::vector<double>& values) {
  return values.empty()
             ? 0.0
             : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

template <class Member>
std::vector<double> series(const FlightReport& report, const Member& member) {
  std::vector<double> values;
  values.reserve(report.frames.size());
  for (const FlightFrame& frame : report.frames) values.push_back(static_cast<double>(member(frame.cost)));
  return values;
}

Json distribution(const std::vector<double>& values) {
  return {{"mean", mean(values)},
          {"p50", percentile(values, 0.5)},
          {"p95", percentile(values, 0.95)},
          {"p99", percentile(values, 0.99)},
          {"max", percentile(values, 1.0)}};
}

Json errorJson(const ErrorMeasure& error, double tauPixels) {
  return {{"max_px", error.maxPixels},
          {"max_over_tau", error.maxPixels / tauPixels},
          {"p999_px", error.percentile999()},
          {"rms_px", error.rms()},
          {"fraction_above_tau", error.fractionAboveTau()},
          {"pixels", error.pixels},
          {"max_at_pixel", {error.maxAt.x, error.maxAt.y}}};
}

Json cracksJson(const CrackMeasure& cracks) {
  Json where = Json::array();
  for (const glm::ivec2 place : cracks.where) where.push_back({place.x, place.y});
  return {{"cracks", cracks.cracks},
          {"see_through", cracks.seeThrough},
          {"checked_pixels", cracks.checked},
          {"sky_pixels", cracks.skyPixels},
          {"where", where}};
}

bool wasMeasured(const FlightReport& report) {
  return std::any_of(report.frames.begin(), report.frames.end(),
                     [](const FlightFrame& f) { return f.error.has_value(); });
}

}  // namespace

Json reportToJson(const FlightReport& report, const FlightHead& head, const FlyOptions& options) {
  Json out;
  out["bench"] = "flight";
  out["machine"] = describeMachine();
  out["dataset"] = head.dataset;
  out["flight"] = head.flight;
  out["surface"] = head.surface;
  out["renderer"] = head.renderer;
  out["width"] = options.width;
  out["height"] = options.height;
  out["tau"] = options.tauPixels;
  out["k"] = head.k;
  if (options.fovyDegrees) out["fovy"] = *options.fovyDegrees;

  // The whole flight in a few numbers.
  Json& summary = out["summary"];
  summary["frames"] = report.frames.size();
  summary["time_ms"] = distribution(series(report, [](const FrameCost& c) { return c.timeMs; }));
  summary["select_ms"] = distribution(series(report, [](const FrameCost& c) { return c.selectMs; }));
  summary["draw_ms"] = distribution(series(report, [](const FrameCost& c) { return c.drawMs; }));
  summary["triangles"] = distribution(series(report, [](const FrameCost& c) { return c.triangles; }));
  summary["patches"] = distribution(series(report, [](const FrameCost& c) { return c.patches; }));
  summary["tiles"] = distribution(series(report, [](const FrameCost& c) { return c.tiles; }));
  summary["draw_calls"] = distribution(series(report, [](const FrameCost& c) { return c.drawCalls; }));
  uint64_t bytes = 0;
  uint64_t requests = 0;
  uint64_t memoryBytes = 0;
  int deepestLevel = 0;
  for (const FlightFrame& frame : report.frames) {
    bytes += frame.cost.bytes;
    requests += frame.cost.requests;
    memoryBytes = std::max(memoryBytes, frame.cost.memoryBytes);
    deepestLevel = std::max(deepestLevel, frame.cost.deepestLevel);
  }
  summary["bytes"] = bytes;
  summary["requests"] = requests;
  summary["memory"] = memoryBytes;
  summary["deepest_level"] = deepestLevel;
  if (wasMeasured(report)) {
    summary["error"] = errorJson(report.error, options.tauPixels);
    summary["error"]["max_at_seconds"] = report.worstErrorSeconds;
    summary["error"]["max_at_local"] = {report.error.maxPoint.x, report.error.maxPoint.y,
                                        report.error.maxPoint.z};
    summary["resident"] = cracksJson(report.cracks);
  }
  if (report.loadingPictures > 0) {
    summary["loading"] = cracksJson(report.loading);
    summary["loading"]["pictures"] = report.loadingPictures;
  }

  // The series.
  out["frames"] = Json::array();
  for (const FlightFrame& frame : report.frames) {
    const FrameCost& cost = frame.cost;
    Json entry = {{"seconds", frame.seconds},
                  {"time_ms", cost.timeMs},
                  {"select_ms", cost.selectMs},
                  {"draw_ms", cost.drawMs},
                  {"triangles", cost.triangles},
                  {"patches", cost.patches},
                  {"tiles", cost.tiles},
                  {"draw_calls", cost.drawCalls},
                  {"bytes", cost.bytes},
                  {"requests", cost.requests},
                  {"deepest_level", cost.deepestLevel},
                  {"memory", cost.memoryBytes}};
    if (frame.error) entry["error"] = errorJson(*frame.error, options.tauPixels);
    if (frame.cracks) entry["resident"] = cracksJson(*frame.cracks);
    out["frames"].push_back(std::move(entry));
  }
  return out;
}

std::string reportToText(const FlightReport& report, const FlightHead& head, const FlyOptions& options) {
  const auto times = series(report, [](const FrameCost& c) { return c.timeMs; });
  const auto triangles = series(report, [](const FrameCost& c) { return c.triangles; });
  const auto patches = series(report, [](const FrameCost& c) { return c.patches; });
  const auto drawCalls = series(report, [](const FrameCost& c) { return c.drawCalls; });
  const auto bytes = series(report, [](const FrameCost& c) { return c.bytes; });
  const auto memory = series(report, [](const FrameCost& c) { return c.memoryBytes; });
  const auto count = [](double value) { return formatCount(static_cast<int64_t>(std::llround(value))); };
  const auto size = [](double value) { return formatBytes(static_cast<uint64_t>(value)); };

  std::string text =
      fmt::format("{} over {}, {} with K = {}, {} x {}, tau {} px\n{}\n", head.flight, head.dataset,
                  head.surface, head.k, options.width, options.height, options.tauPixels, head.renderer);
  text += fmt::format("  frames      {}\n", count(static_cast<double>(report.frames.size())));
  text += fmt::format("  frame time  p50 {:.1f} ms, p95 {:.1f} ms, p99 {:.1f} ms, max {:.1f} ms\n",
                      percentile(times, 0.5), percentile(times, 0.95), percentile(times, 0.99),
                      percentile(times, 1.0));
  text += fmt::format("  triangles   mean {}, max {}\n", count(mean(triangles)),
                      count(percentile(triangles, 1.0)));
  text +=
      fmt::format("  patches     mean {}, max {}\n", count(mean(patches)), count(percentile(patches, 1.0)));
  text += fmt::format("  draw calls  mean {:.1f}\n", mean(drawCalls));
  text += fmt::format("  read        {}, memory at most {}\n",
                      size(std::accumulate(bytes.begin(), bytes.end(), 0.0)), size(percentile(memory, 1.0)));
  if (wasMeasured(report)) {
    text += fmt::format(
        "  error       max {:.3f} px ({:.3f} tau) at {:.2f} s, 99.9 % below {:.2f} px, rms {:.3f} px\n",
        report.error.maxPixels, report.error.maxPixels / options.tauPixels, report.worstErrorSeconds,
        report.error.percentile999(), report.error.rms());
    text += fmt::format("  cracks      {} of {} pixels of ground; {} see-through\n", report.cracks.cracks,
                        formatCount(report.cracks.checked), report.cracks.seeThrough);
  }
  if (report.loadingPictures > 0 && report.loading.checked == 0) {
    text +=
        "  loading     cracks can only be told from above the highest ground: fly p2_straight or "
        "p5_turnover\n";
  } else if (report.loadingPictures > 0) {
    text += fmt::format("  loading     {} cracks of {} pixels of ground in {} pictures\n",
                        report.loading.cracks, formatCount(report.loading.checked), report.loadingPictures);
  }
  return text;
}

}  // namespace terrane
