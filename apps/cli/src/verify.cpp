#include "terrane/bake/verify.h"

#include <fmt/format.h>

#include "commands.h"
#include "common.h"
#include "terrane/bake/compare.h"
#include "terrane/base/format_number.h"
#include "terrane/dataset/dataset.h"

namespace terrane::cli {

namespace {

constexpr const char* kVerifyExamples =
    "Examples:\n"
    "  terrane verify alps.terrane\n"
    "  terrane verify alps.terrane --against dem.tif\n"
    "  terrane verify all.terrane --against country.tif --against village.tif     as it was built\n"
    "\n"
    "With --json: stages and warnings as `terrane build` prints them, and at last {\"ok\", \"tiles\", "
    "\"nodes\", \"bytes\",\n"
    "\"fault_count\", \"faults\", \"seconds\"}; with --against also \"against\": {\"ok\", \"compared\", "
    "\"only_in_source\",\n"
    "\"only_in_dataset\", \"interpolated\", \"largest_meters\", \"mean_meters\", \"largest_at\", "
    "\"bound_meters\"}.\n"
    "\n"
    "Exit status: 0 sound (and within its bound of the source), 1 faults or failed, 2 wrong usage.";

struct VerifyArguments {
  std::string dataset;
  std::vector<std::string> against;
  CompareOptions compare;
  VerifyOptions verify;
  OutputOptions output;
};

nlohmann::json toJson(const VerifyReport& report) {
  return {{"ok", report.faultCount == 0}, {"tiles", report.tiles},   {"nodes", report.nodes},
          {"bytes", report.bytes},        {"faults", report.faults}, {"fault_count", report.faultCount},
          {"seconds", report.seconds}};
}

nlohmann::json toJson(const ComparisonReport& report) {
  nlohmann::json out = {{"ok", report.agrees()},
                        {"compared", report.compared},
                        {"only_in_source", report.onlyInSource},
                        {"only_in_dataset", report.onlyInDataset},
                        {"interpolated", report.interpolated},
                        {"largest_meters", report.largestMeters},
                        {"mean_meters", report.meanMeters},
                        {"largest_at", {report.largestEasting, report.largestNorthing}},
                        {"bound_meters", report.boundMeters}};
  if (report.ownSamples) {
    const OwnSamples& own = *report.ownSamples;
    out["own_samples"] = {{"compared", own.compared},
                          {"largest_meters", own.largestMeters},
                          {"mean_meters", own.meanMeters},
                          {"largest_at", {own.largestEasting, own.largestNorthing}}};
  }
  return out;
}

void say(const VerifyArguments& options, const VerifyReport& report) {
  for (const std::string& fault : report.faults) fmt::print("{}\n", fault);
  if (report.faultCount > report.faults.size()) {
    fmt::print("... and {} more\n", report.faultCount - report.faults.size());
  }
  if (report.faultCount > 0) {
    fmt::print("{}: {} faults\n", options.dataset, report.faultCount);
  } else {
    fmt::print("{}: sound ({}, {} tiles, {} nodes, in {})\n", options.dataset, formatBytes(report.bytes),
               formatCount(static_cast<int64_t>(report.tiles)),
               formatCount(static_cast<int64_t>(report.nodes)), formatDuration(report.seconds));
  }
}

void say(const ComparisonReport& report) {
  fmt::print(
      "against the source: {} samples, largest difference {:.6g} m (bound {:.6g} m) at {:.3f}, {:.3f}; mean "
      "{:.6g} m\n",
      formatCount(static_cast<int64_t>(report.compared)), report.largestMeters, report.boundMeters,
      report.largestEasting, report.largestNorthing, report.meanMeters);
  if (!report.sameVoids()) {
    fmt::print("ground differs: {} samples only in the source, {} only in the dataset\n",
               formatCount(static_cast<int64_t>(report.onlyInSource)),
               formatCount(static_cast<int64_t>(report.onlyInDataset)));
  }
  if (report.ownSamples) {
    const OwnSamples& own = *report.ownSamples;
    fmt::print(
        "that is of the source as it was warped; its own samples, {} of them, are {:.3g} m off on average, "
        "at most {:.3g} m, at {:.3f}, {:.3f}\n",
        formatCount(static_cast<int64_t>(own.compared)), own.meanMeters, own.largestMeters,
        own.largestEasting, own.largestNorthing);
  } else if (report.isWarped)
    fmt::print(
        "the source was warped, and is compared as it was warped: its own samples may be further away\n");
  fmt::print("{}\n", report.agrees() ? "the dataset agrees with its source"
                                     : "the dataset DOES NOT agree with its source");
}

int runVerify(VerifyArguments options) {
  options.verify.cancel = &interruptFlag();
  options.compare.cancel = &interruptFlag();
  options.compare.threads = options.verify.threads;

  const std::unique_ptr<CommandProgress> progress = makeProgress(options.output);
  const auto report = verifyDataset(options.dataset, options.verify, *progress);
  if (!report.ok()) return fail(report.error(), options.output);
  bool sound = report->faultCount == 0;
  nlohmann::json json = toJson(*report);

  // A dataset with faults is not worth comparing.
  std::optional<ComparisonReport> comparison;
  if (sound && !options.against.empty()) {
    const auto dataset = Dataset::open(options.dataset);
    if (!dataset.ok()) return fail(dataset.error(), options.output);
    const auto compared = compareWithSource(*dataset, options.against, options.compare, *progress);
    if (!compared.ok()) return fail(compared.error(), options.output);
    comparison = *compared;
    sound = comparison->agrees();
    json["against"] = toJson(*comparison);
  }
  progress->finish();

  json["ok"] = sound;
  if (options.output.json) {
    printJson(json);
  } else if (!options.output.quiet || !sound) {
    say(options, *report);
    if (comparison) say(*comparison);
  }
  return sound ? kExitOk : kExitFailed;
}

}  // namespace

void addVerifyCommand(CLI::App& app, CommandContext& context) {
  CLI::App* command =
      app.add_subcommand("verify", "Check every byte of a dataset, and compare it with its source");
  command->footer(kVerifyExamples);
  const auto options = std::make_shared<VerifyArguments>();
  command->add_option("DATASET", options->dataset, "The dataset, NAME.terrane")->required();
  command->add_option("--against", options->against,
                      "Rasters it was built from, in the same order (repeatable)");
  command->add_option("--source-crs", options->compare.sourceCrs,
                      "CRS of rasters, where the manifest does not tell");
  command->add_option("--nodata", options->compare.noData,
                      "The value that stands for no data in the rasters");
  command->add_option("--threads", options->verify.threads, "Threads to work with (default: all cores)")
      ->check(CLI::Range(1, 1024));
  addOutputOptions(*command, options->output);
  command->callback([&context, options] { context.run = [options] { return runVerify(*options); }; });
}

}  // namespace terrane::cli
