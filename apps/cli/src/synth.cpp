#include "terrane/bake/synth.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "commands.h"
#include "common.h"
#include "terrane/base/format_number.h"

namespace terrane::cli {
namespace {

constexpr const char* kSynthExamples =
    "Examples:\n"
    "  terrane synth -o dem.tif                                  41 km a side at 10 m\n"
    "  terrane synth -o dem.tif --color land.tif --seed 7        another world, and its colours\n"
    "  terrane synth -o big.tif --size 16385                     164 km a side\n"
    "  terrane synth -o small.tif --size 1025x513 --spacing 30 --type int16\n"
    "\n"
    "The middle of every size is the same place: a larger size shows more of the same ground.";

struct SynthArguments {
  SynthOptions options;
  std::string size = "4097";
  std::string type = "float32";
  OutputOptions output;
};

/// "4097" or "4097x2049": samples a side, or columns x rows.
Status parseSize(const std::string& text, SynthOptions& options) {
  long long cols = 0;
  long long rows = 0;
  int end = 0;
  const int length = static_cast<int>(text.size());
  if (length < 20 && std::sscanf(text.c_str(), "%lld%n", &cols, &end) == 1 && end == length) {
    options.cols = options.rows = cols;
    return {};
  }
  if (length < 20 && std::sscanf(text.c_str(), "%lldx%lld%n", &cols, &rows, &end) == 2 && end == length) {
    options.cols = cols;
    options.rows = rows;
    return {};
  }
  return makeError("--size {}: not a size; pass samples a side (4097) or columns x rows (4097x2049)", text);
}

int runSynth(const SynthArguments& arguments) {
  SynthOptions options = arguments.options;
  if (const Status size = parseSize(arguments.size, options); !size.ok()) {
    fail(size.error(), arguments.output);
    return kExitUsage;
  }
  options.type = arguments.type == "int16" ? SynthType::kInt16 : SynthType::kFloat32;
  options.cancel = &interruptFlag();
  const std::unique_ptr<CommandProgress> progress = makeProgress(arguments.output);
  const Result<SynthReport> made = synthesize(options, *progress);
  progress->finish();
  if (!made.ok()) return fail(made.error(), arguments.output);
  const SynthReport& report = *made;
  if (arguments.output.json) {
    nlohmann::json result = {{"output", options.output}, {"cols", report.cols},
                             {"rows", report.rows},      {"spacing", options.spacingMeters},
                             {"seed", options.seed},     {"min", report.minMeters},
                             {"max", report.maxMeters},  {"water_share", report.waterShare},
                             {"bytes", report.bytes},    {"seconds", report.seconds}};
    if (!options.colorOutput.empty()) {
      result["color"] = options.colorOutput;
      result["color_bytes"] = report.colorBytes;
    }
    printJson(result);
  } else if (!arguments.output.quiet) {
    std::printf("%s: %lld x %lld samples, %.0f to %.0f m, %.0f %% water, %s in %s\n", options.output.c_str(),
                static_cast<long long>(report.cols), static_cast<long long>(report.rows), report.minMeters,
                report.maxMeters, report.waterShare * 100.0, formatBytes(report.bytes).c_str(),
                formatDuration(report.seconds).c_str());
    if (!options.colorOutput.empty()) {
      std::printf("%s: its colours, %s\n", options.colorOutput.c_str(),
                  formatBytes(report.colorBytes).c_str());
    }
  }
  return kExitOk;
}

}  // namespace

void addSynthCommand(CLI::App& app, CommandContext& context) {
  CLI::App* command =
      app.add_subcommand("synth", "Make up a piece of country: heights, and if asked its colours");
  const auto arguments = std::make_shared<SynthArguments>();
  SynthOptions& options = arguments->options;
  command->add_option("-o,--output", options.output, "GeoTIFF of heights to write")->required();
  command->add_option("--color", options.colorOutput, "also write an RGB GeoTIFF of the land's colours");
  command->add_option("--size", arguments->size, "samples a side, or COLSxROWS")->capture_default_str();
  command->add_option("--spacing", options.spacingMeters, "metres between samples")->capture_default_str();
  command->add_option("--seed", options.seed, "which world")->capture_default_str();
  command->add_option("--type", arguments->type, "float32, or int16 for whole metres")
      ->check(CLI::IsMember({"float32", "int16"}))
      ->capture_default_str();
  command->add_flag("--overwrite", options.overwrite, "replace files that exist");
  command->add_option("--threads", options.threads, "0: all cores")->capture_default_str();
  addOutputOptions(*command, arguments->output);
  command->footer(kSynthExamples);
  command->callback([&context, arguments] { context.run = [arguments] { return runSynth(*arguments); }; });
}

}  // namespace terrane::cli
