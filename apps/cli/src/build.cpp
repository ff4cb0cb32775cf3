#include "terrane/bake/build.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "commands.h"
#include "common.h"
#include "imagery_options.h"
#include "source_options.h"
#include "terrane/bake/source.h"
#include "terrane/base/format_number.h"

namespace terrane::cli {

namespace {

constexpr const char* kBuildExamples =
    "Examples:\n"
    "  terrane build dem.tif -o alps.terrane\n"
    "  terrane build tiles/ -o country.terrane --crs EPSG:25832     a folder, warped to one CRS\n"
    "  terrane build country.tif village.tif -o all.terrane         later inputs lie on top\n"
    "  terrane build @files.txt -o all.terrane --max-error 0.1      inputs listed in a file\n"
    "  terrane build dem.tif -o photo.terrane --imagery photo.tif\n"
    "  terrane build dem.tif -o all.terrane --imagery land=b4.tif+b3.tif+b2.tif photo=west.tif east.tif\n"
    "  terrane build new/*.tif -o all.terrane --append              on top of a dataset that is there\n"
    "  terrane build lidar/ -o valley.terrane --spacing 2           coarser than the files\n"
    "  terrane build old.asc -o old.terrane --source-crs EPSG:31467 --nodata -9999\n"
    "\n"
    "A build works in NAME.terrane.partial, beside the output. There it takes, with the result, 7 to 9 bytes "
    "for "
    "each sample\n"
    "of the inputs, 17 where these may have voids, 25 where inputs of several resolutions are put together. "
    "Interrupt it\n"
    "or kill it, and the same command goes on from what is done. A dataset that is replaced stands until the "
    "new one\n"
    "takes its place.\n"
    "\n"
    "With --append the result is what a build of all the inputs, old ones first, would have been; the old "
    "ones "
    "need not be\n"
    "there. The dataset must be lossless, without imagery and all of one resolution, and the new inputs must "
    "fall on its "
    "samples, "
    "inside its\n"
    "world (the power of two above its size, from its north-western corner); else the message says why a "
    "whole "
    "build is\n"
    "needed.\n"
    "\n"
    "With --json: a line {\"stage\", \"steps\", \"unit\", \"seconds\"} as each stage ends, {\"warning\"} "
    "lines, and at last\n"
    "{\"output\", \"tiles\", \"tiles_copied\", \"tiles_encoded\", \"archive_bytes\", \"samples\", "
    "\"bits_per_sample\",\n"
    "\"imagery_tiles\", \"imagery_bytes\", \"seconds\", \"jobs_done\", \"jobs_resumed\",\n"
    "\"jobs\": {STAGE: {\"done\", \"resumed\"}}, \"peak_rss_bytes\", \"cpu_seconds\"} or {\"error\"}.\n"
    "\n"
    "Exit status: 0 built, 1 failed (the message says what is left to go on from), 2 wrong usage.";

struct BuildArguments {
  SourceOptions source;
  BuildOptions build;
  ImageryArguments imagery;
  OutputOptions output;
  std::string memory;
  std::string layers;
  bool append = false;
};

void say(const BuildReport& report, const BuildArguments& options) {
  if (options.output.json) {
    int64_t done = 0;
    int64_t resumed = 0;
    nlohmann::json stages = nlohmann::json::object();
    for (const StageReport& stage : report.stages) {
      done += stage.jobsDone;
      resumed += stage.jobsResumed;
      stages[stage.name] = {{"done", stage.jobsDone}, {"resumed", stage.jobsResumed}};
    }
    const ResourceUse use = resourceUse();
    printJson({{"output", options.build.output},
               {"tiles", report.tiles},
               {"tiles_copied", report.tilesCopied},
               {"tiles_encoded", report.tiles - report.tilesCopied},
               {"archive_bytes", report.archiveBytes},
               {"samples", report.samples},
               {"bits_per_sample", report.bitsPerSample},
               {"imagery_tiles", report.imageryTiles},
               {"imagery_bytes", report.imageryBytes},
               {"seconds", report.seconds},
               {"jobs_done", done},
               {"jobs_resumed", resumed},
               {"jobs", stages},
               {"peak_rss_bytes", use.peakRssBytes},
               {"cpu_seconds", use.cpuSeconds}});
  } else if (!options.output.quiet) {
    const std::string copied =
        options.append
            ? fmt::format(" ({} as they were)", formatCount(static_cast<int64_t>(report.tilesCopied)))
            : "";
    fmt::print("{}: {} tiles, {}, {:.2f} bits a sample, in {}\n", options.build.output,
               formatCount(static_cast<int64_t>(report.tiles)) + copied, formatBytes(report.archiveBytes),
               report.bitsPerSample, formatDuration(report.seconds));
    if (report.imageryTiles > 0) {
      fmt::print("imagery: {} tiles, {}\n", formatCount(static_cast<int64_t>(report.imageryTiles)),
                 formatBytes(report.imageryBytes));
    }
  }
}

/// Bounds, as "12,3".
Result<std::vector<double>> parseLayers(const std::string& text) {
  std::vector<double> bounds;
  for (size_t at = 0; at <= text.size();) {
    const size_t comma = std::min(text.find(',', at), text.size());
    double bound = 0.0;
    const auto [end, code] = std::from_chars(text.data() + at, text.data() + comma, bound);
    if (code != std::errc() || end != text.data() + comma)
      return makeError("--layers {}: must be numbers of metres, as 12,3, or auto", text);
    bounds.push_back(bound);
    at = comma + 1;
  }
  return bounds;
}

int runBuild(BuildArguments options) {
  if (!options.memory.empty()) {
    const auto bytes = parseByteSize(options.memory);
    if (!bytes.ok()) {
      fail(bytes.error(), options.output);
      return kExitUsage;
    }
    options.build.memoryBytes = *bytes;
  }
  auto imagery = parseImagery(options.imagery);
  if (!imagery.ok()) {
    fail(imagery.error(), options.output);
    return kExitUsage;
  }
  options.build.imagery = std::move(imagery).value();
  options.build.optionsText = describeSource(options.source);
  if (const std::string text = describeImagery(options.imagery); !text.empty())
    options.build.optionsText += (options.build.optionsText.empty() ? "" : " ") + text;
  if (!options.layers.empty()) {
    options.build.layersBySpacing = options.layers == "auto";
    if (!options.build.layersBySpacing) {
      auto layers = parseLayers(options.layers);
      if (!layers.ok()) {
        fail(layers.error(), options.output);
        return kExitUsage;
      }
      options.build.layerErrors = std::move(layers).value();
    }
    options.build.optionsText +=
        (options.build.optionsText.empty() ? "" : " ") + ("--layers " + options.layers);
  }
  options.build.cancel = &interruptFlag();

  // An output that cannot be made is known before the inputs are read.
  options.build.overwrite = options.build.overwrite || options.append;
  const Status target = checkOutput(options.build);
  if (!target.ok()) return fail(target.error(), options.output);
  const std::unique_ptr<CommandProgress> progress = makeProgress(options.output);
  const auto source = options.append ? openAppendedSource(options.source, options.build.output, *progress)
                                     : openSource(options.source, *progress);
  if (!source.ok()) return fail(source.error(), options.output);
  const auto report = buildDataset(**source, options.build, *progress);
  if (report.ok()) progress->finish();
  if (!report.ok()) return fail(report.error(), options.output);
  say(*report, options);
  return kExitOk;
}

}  // namespace

void addBuildCommand(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("build", "Make a dataset from elevation rasters");
  command->footer(kBuildExamples);
  const auto options = std::make_shared<BuildArguments>();
  SourceOptions& source = options->source;
  BuildOptions& build = options->build;
  command->add_option("INPUT", source.inputs, kInputArgument)->required();
  command->add_option("-o,--output", build.output, "The dataset to make, NAME.terrane")->required();
  CLI::Option* overwrite =
      command->add_flag("--overwrite", build.overwrite, "Replace a dataset that stands there");
  CLI::Option* append = command->add_flag(
      "--append", options->append, "Lay the inputs over the dataset that stands there, on its samples");
  append->excludes(overwrite);
  addSourceOptions(*command, source);
  for (const char* option : {"--crs", "--lossless", "--max-error", "--spacing", "--resampling"})
    append->excludes(command->get_option(option));
  command
      ->add_option("--layers", options->layers,
                   "Divide the samples into layers that viewers fetch as they need them, for thin lines: "
                   "one to three falling error "
                   "bounds in metres above --max-error, as 12,3, or auto, by the spacing")
      ->type_name("METRES|auto");
  append->excludes(command->get_option("--layers"));
  command->add_option("--attribution", build.attribution,
                      "Whose data it is, for the manifest and for viewers");
  addImageryOptions(*command, options->imagery);
  append->excludes(command->get_option("--imagery"));
  command->add_option("--threads", build.threads, "Threads to work with (default: all cores)")
      ->check(CLI::Range(1, 1024));
  command->add_option("--memory", options->memory, "Memory to work with, as 500M or 2G (default: a quarter)");
  addOutputOptions(*command, options->output);
  command->callback([&context, options] { context.run = [options] { return runBuild(*options); }; });
}

}  // namespace terrane::cli
