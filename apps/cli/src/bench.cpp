#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "bench_stream.h"
#include "commands.h"
#include "common.h"
#include "picture_options.h"
#include "terrane/engine/read_flight.h"
#include "terrane/measure/bench_result.h"
#include "terrane/measure/fly.h"
#include "terrane/reference/load_reference.h"
#include "terrane/scene/terrain_scene.h"
#include "terrane/stream/transport.h"

namespace terrane::cli {

namespace {

struct BenchOptions {
  std::string dataset;
  std::string flight;
  std::string surface = "patches";
  std::string size = "1280x720";
  std::string morph = "on";
  std::string policy, line = "40Mbit/s,50ms";
  std::string output, plot;
  int patchSamples = 17;
  bool reference = false;
  bool overwrite = false;
  FlyOptions fly;
  TerrainOptions terrain;
  PatchSelection selection;
  OutputOptions talk;
};

Status checkOptions(BenchOptions& options) {
  FlyOptions& fly = options.fly;
  TERRANE_TRY(parsePictureSize(options.size, fly.width, fly.height));
  TERRANE_TRY(parseSurface(options.surface, options.patchSamples, options.selection));
  options.selection.morph = options.morph == "on";
  fly.tauPixels = options.selection.tolerancePixels;
  if (!options.policy.empty()) {
    TERRANE_TRY(parseLine(options.line));
    if (isUrl(options.dataset))
      return makeError("{}: --policy simulates the line; pass a dataset on disk", options.dataset);
  }
  for (const std::string& path : {options.output, options.plot}) {
    if (!path.empty() && !options.overwrite && std::filesystem::exists(path)) {
      return makeError("{}: exists already; pass --overwrite to replace it", path);
    }
  }
  return {};
}

/// A path without its folders.
std::string fileName(const std::string& path) {
  std::filesystem::path name(path);
  if (!name.has_filename()) name = name.parent_path();
  return name.filename().string();
}

/// The report, in all the forms that were asked for.
Status tell(const BenchOptions& options, const nlohmann::ordered_json& json, const std::string& text) {
  if (!options.output.empty()) TERRANE_TRY(writeTextFile(options.output, json.dump(1) + "\n"));
  if (options.talk.json) {
    printJson(json);
  } else if (!options.talk.quiet) {
    std::fputs(text.c_str(), stdout);
  }
  return {};
}

/// The flight over a simulated line.
Status runStreamBench(const BenchOptions& options, Terrain& terrain, const FittedFlight& flight,
                      const ReferenceSurface* reference, FlightHead& head, CommandProgress& progress) {
  StreamBench bench{options.dataset,
                    flight,
                    options.fly,
                    StreamPolicy::Available,
                    {},
                    options.selection,
                    reference,
                    options.terrain.forceSoftware};
  for (const auto& [name, policy] : streamPolicies())
    if (name == options.policy) bench.policy = policy;
  TERRANE_ASSIGN(bench.line, parseLine(options.line));
  TERRANE_ASSIGN(const StreamBenchResult result, flyStreamBench(bench, terrain, progress));
  progress.finish();
  head.renderer = result.rendererName;
  return tell(options, streamReportToJson(result.report, head, result.options),
              streamReportToText(result.report, head, result.options));
}

Status runBench(BenchOptions& options) {
  TERRANE_TRY(checkOptions(options));
  const auto progress = makeProgress(options.talk);
  TERRANE_ASSIGN(Dataset dataset, openDatasetArgument(options.dataset, *progress));
  const std::unique_ptr<Terrain> terrain = Terrain::over(std::move(dataset), options.terrain);
  TERRANE_ASSIGN(const FittedFlight flight, readFlight(options.flight, *terrain));

  // The truth to measure against, where somebody asks for it.
  std::optional<ReferenceSurface> reference;
  std::optional<ReferenceSurface::Cover> cover;
  if (options.reference || options.fly.loadingViews > 0) {
    progress->beginStage("reference", 1, "surfaces");
    TERRANE_ASSIGN(reference, loadReference(terrain->dataset()));
    progress->advance(1);
  }
  if (options.fly.loadingViews > 0) {
    cover.emplace(*reference, coarsestCellMargin(terrain->dataset().manifest().frame));
  }

  FlightHead head{fileName(terrain->dataset().directory()),
                  std::filesystem::path(options.flight).stem().string(), options.surface, "",
                  options.selection.surface == SurfaceKind::Meshes ? MeshScale().grid.samplesPerSide()
                                                                   : options.patchSamples};
  if (!options.policy.empty())
    return runStreamBench(options, *terrain, flight, reference ? &*reference : nullptr, head, *progress);

  TerrainScene scene(*terrain, options.selection);
  TERRANE_ASSIGN(const FlightReport report,
                 fly(scene, flight, options.fly, options.reference ? &*reference : nullptr,
                     cover ? &*cover : nullptr, *progress));
  progress->finish();
  head.renderer = terrain->rendererName();
  if (!options.plot.empty()) TERRANE_TRY(writeTextFile(options.plot, plotReport(report, head, options.fly)));
  return tell(options, reportToJson(report, head, options.fly), reportToText(report, head, options.fly));
}

constexpr const char* kBenchExamples =
    "Examples:\n"
    "  terrane bench alps.terrane --flight bench/flights/valley.json\n"
    "  terrane bench alps.terrane --flight bench/flights/p3_descent.json -o p3.json --plot p3.svg\n"
    "  terrane bench alps.terrane --flight bench/flights/p1_dolly.json --reference --reference-every 30\n"
    "  terrane bench alps.terrane --flight bench/flights/p5_turnover.json --frames 1 --loading 4\n"
    "  terrane bench alps.terrane --flight bench/flights/valley.json --policy available --line "
    "40Mbit/s,50ms\n"
    "  terrane bench https://terrain.example.org/d/alps --flight bench/flights/valley.json\n"
    "\n"
    "docs/flights.md tells what a flight and what a report hold.";

}  // namespace

void addBenchCommand(CLI::App& app, CommandContext& context) {
  const auto options = std::make_shared<BenchOptions>();
  CLI::App* command = app.add_subcommand("bench", "fly over a dataset, and measure cost and error");
  command->footer(kBenchExamples);
  command->add_option("DATASET", options->dataset, kDatasetArgument)->required();
  command->add_option("--flight", options->flight, "a camera path (docs/flights.md)")->required();
  command->add_option("--surface", options->surface, "how tiles become triangles")
      ->capture_default_str()
      ->check(CLI::IsMember(kSurfaceNames));
  command->add_option("--size", options->size, "picture size in pixels")->capture_default_str();
  CLI::Option* framesPerSecond =
      command->add_option("--fps", options->fly.framesPerSecond, "frames for each second of the flight")
          ->capture_default_str()
          ->check(CLI::Range(0.01, 1000.0));
  CLI::Option* frames =
      command->add_option("--frames", options->fly.frames, "as many frames, evenly spread, instead");
  frames->check(CLI::Range(1, 1000000))->excludes(framesPerSecond);
  command->add_option("--tau", options->selection.tolerancePixels, "largest error on screen, pixels")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1000.0));
  command
      ->add_option("--k", options->patchSamples,
                   "samples along the side of one of --surface patches, 2^k + 1 from 3 to 129")
      ->capture_default_str();
  command->add_option("--morph", options->morph, "let patches glide into being as one comes nearer")
      ->capture_default_str()
      ->check(CLI::IsMember({"on", "off"}));
  command
      ->add_option("--fov", options->fly.fovyDegrees, "vertical field of view in degrees, else the flight's")
      ->check(CLI::Range(1.0, 170.0));

  command->add_flag("--reference", options->reference,
                    "measure error and cracks against the full-resolution surface");
  command
      ->add_option("--reference-every", options->fly.referenceEvery, "frames from one measured to the next")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  CLI::Option* loading =
      command
          ->add_option("--loading", options->fly.loadingViews,
                       "views at which cracks are counted while tiles load in random orders")
          ->check(CLI::Range(0, 100000));
  command->add_option("--seed", options->fly.seed, "of the random orders")->capture_default_str();
  command->add_flag("--software", options->terrain.forceSoftware,
                    "Mesa's rasteriser even where there is a GPU");

  command->add_option("-o,--output", options->output, "the report, JSON");
  CLI::Option* plot = command->add_option("--plot", options->plot, "the series as a picture, SVG");

  std::vector<std::string> policies;
  for (const auto& [name, policy] : streamPolicies()) policies.push_back(name);
  CLI::Option* policy =
      command
          ->add_option(
              "--policy", options->policy,
              "fly over a simulated line, in simulated time, drawing what has come by this rule (with "
              "--reference: measured in each frame)")
          ->check(CLI::IsMember(policies))
          ->excludes(frames)
          ->excludes(loading)
          ->excludes(plot);
  command->add_option("--line", options->line, "that line: how fast, and how late an answer begins")
      ->capture_default_str()
      ->needs(policy);
  command->add_flag("--overwrite", options->overwrite, "replace files that exist");
  addOutputOptions(*command, options->talk);
  command->callback([&context, options] {
    context.run = [options] {
      const Status done = runBench(*options);
      return done.ok() ? kExitOk : fail(done.error(), options->talk);
    };
  });
}

}  // namespace terrane::cli
