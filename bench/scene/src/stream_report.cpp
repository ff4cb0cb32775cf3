#include <algorithm>

#include "terrane/base/format_number.h"
#include "terrane/measure/bench_result.h"
#include "terrane/scene/stream_flight.h"

namespace terrane {
namespace {

std::string nameOf(StreamPolicy policy) {
  for (const auto& [name, value] : streamPolicies())
    if (value == policy) return name;
  return {};
}

}  // namespace

const std::vector<std::pair<std::string, StreamPolicy>>& streamPolicies() {
  static const std::vector<std::pair<std::string, StreamPolicy>> policies = {
      {"available", StreamPolicy::Available},
      {"progressive", StreamPolicy::Progressive},
      {"all-at-once", StreamPolicy::AllAtOnce}};
  return policies;
}

StreamFlightSummary summaryOf(const StreamFlightReport& report) {
  StreamFlightSummary out;
  for (const StreamFlightFrame& frame : report.frames) {
    out.loosest = std::max(out.loosest, frame.view.stream.looseness);
    out.memoryFactor = std::max(out.memoryFactor, frame.view.memoryFactor);
  }
  if (!report.frames.empty()) out.stream = report.frames.back().view.stream;
  return out;
}

nlohmann::ordered_json streamReportToJson(const StreamFlightReport& report, const FlightHead& head,
                                          const StreamFlightOptions& options) {
  using Json = nlohmann::ordered_json;
  const StreamFlightSummary summary = summaryOf(report);
  Json out = {
      {"bench", "stream"},
      {"machine", describeMachine()},
      {"dataset", head.dataset},
      {"flight", head.flight},
      {"surface", head.surface},
      {"policy", nameOf(options.view.policy)},
      {"line",
       {{"bytes_per_second", options.line.bytesPerSecond}, {"latency_s", options.line.latencySeconds}}},
      {"renderer", head.renderer},
      {"width", options.width},
      {"height", options.height},
      {"fps", options.framesPerSecond},
      {"tau", options.view.selection.tolerancePixels},
      {"k", head.k}};
  out["summary"] = {{"frames", report.frames.size()},
                    {"debt_px_s", report.debtPixelSeconds},
                    {"frames_until_used", report.framesUntilUsed},
                    {"bytes", summary.stream.bytesReceived},
                    {"bytes_unwanted", summary.stream.bytesUnwanted},
                    {"requests", summary.stream.requests},
                    {"tiles", summary.stream.tilesDecoded},
                    {"loosest", summary.loosest},
                    {"memory_factor", summary.memoryFactor}};
  if (options.draw) {
    out["summary"]["cracks"] = report.cracks;
    out["summary"]["crack_pixels"] = report.crackPixels;
    out["summary"]["true_px_s"] = report.excessPixelSeconds;
  }
  out["frames"] = Json::array();
  for (const StreamFlightFrame& frame : report.frames) {
    const StreamStatistics& stream = frame.view.stream;
    Json entry = {{"seconds", frame.seconds},      {"debt_px", frame.debtPixels},
                  {"patches", frame.view.patches}, {"triangles", frame.view.triangles},
                  {"ramping", frame.view.ramping}, {"bytes", stream.bytesReceived},
                  {"requests", stream.requests},   {"bytes_underway", stream.bytesUnderway},
                  {"looseness", stream.looseness}};
    if (options.draw) entry["cracks"] = frame.cracks;
    if (frame.excessPixels >= 0.0) {
      entry["true_px"] = frame.excessPixels;
      entry["p999_px"] = frame.p999Pixels;
    }
    out["frames"].push_back(std::move(entry));
  }
  return out;
}

std::string streamReportToText(const StreamFlightReport& report, const FlightHead& head,
                               const StreamFlightOptions& options) {
  const StreamFlightSummary summary = summaryOf(report);
  std::string text = fmt::format(
      "{} over {}, {}, a line of {:.4g} Mbit/s and {:.4g} ms, {} with K = {}, {} x {} at {:.4g} frames/s, "
      "tau {} px\n",
      head.flight, head.dataset, nameOf(options.view.policy), options.line.bytesPerSecond * 8e-6,
      options.line.latencySeconds * 1e3, head.surface, head.k, options.width, options.height,
      options.framesPerSecond, options.view.selection.tolerancePixels);
  text += fmt::format("  frames      {}\n", formatCount(static_cast<int64_t>(report.frames.size())));
  text += fmt::format(
      "  debt        {:.0f} px s: error above tau that waits for tiles, times its pixels and the time\n",
      report.debtPixelSeconds);
  text += fmt::format("  tiles       {}, drawn from at most {} frames after they came\n",
                      formatCount(static_cast<int64_t>(summary.stream.tilesDecoded)), report.framesUntilUsed);
  text += fmt::format(
      "  fetched     {} in {} requests, {} of it for nothing\n", formatBytes(summary.stream.bytesReceived),
      formatCount(static_cast<int64_t>(summary.stream.requests)), formatBytes(summary.stream.bytesUnwanted));
  text += fmt::format("  tau         loosened by at most {:.2f} for the line, {:.2f} for memory\n",
                      summary.loosest, summary.memoryFactor);
  if (!options.draw) return text;
  text += fmt::format("  true error  {:.0f} px s above tau\n", report.excessPixelSeconds);
  text += fmt::format("  cracks      {} of {} pixels of ground\n", report.cracks,
                      formatCount(report.crackPixels));
  return text;
}

}  // namespace terrane
