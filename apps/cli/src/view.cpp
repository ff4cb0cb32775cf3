#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "commands.h"
#include "common.h"
#include "imagery_options.h"
#include "serving.h"
#include "source_options.h"
#include "terrane/bake/build.h"
#include "terrane/bake/input_files.h"
#include "terrane/base/format_number.h"
#include "terrane/dataset/hash.h"
#include "view_cache.h"

namespace terrane::cli {
namespace {

constexpr const char* kViewExamples =
    "Examples:\n"
    "  terrane view *.tif                              open the browser on a folder of rasters\n"
    "  terrane view tiles/ --crs EPSG:2056\n"
    "  terrane view dem.tif --imagery photo.tif\n"
    "  terrane view alps.terrane zion.terrane          datasets, as they are\n"
    "  terrane view dem.tif --no-open                  on another machine: the address is printed\n"
    "\n"
    "Rasters are built once, as `terrane build` does, into the cache ($XDG_CACHE_HOME/terrane, else "
    "~/.cache/terrane), and\n"
    "again where they or the options have changed. What was not viewed for 30 days is removed from there; "
    "all of "
    "it may be\n"
    "deleted at any time. To keep a dataset, `terrane build` it.\n"
    "\n"
    "Only this machine can reach the address; `terrane serve` has options for others. Ctrl-C ends it.";

namespace fs = std::filesystem;

constexpr double kKeptDays = 30.0;
constexpr int kUsualPort = 8080;
constexpr double kGraceSeconds = 2.0;

struct ViewArguments {
  SourceOptions source;
  ImageryArguments imagery;
  OutputOptions output;
  std::string viewerFolder;
  std::optional<int> port;
  bool noOpen = false;
  bool rebuild = false;
};

bool isDataset(const std::string& path) {
  std::error_code trouble;
  return fs::is_regular_file(fs::path(path) / "manifest.json", trouble);
}

/// What the dataset is called: for its first input, in letters that an address may have.
std::string nameFor(const std::vector<std::string>& inputs) {
  std::string given = inputs.front();
  while (given.size() > 1 && given.back() == '/') given.pop_back();
  std::string name;
  for (const char c : fs::path(given).stem().string()) {
    const bool isPlain =
        (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    if (isPlain || (!name.empty() && name.back() != '-')) name += isPlain ? c : '-';
  }
  while (!name.empty() && name.back() == '-') name.pop_back();
  return name.empty() ? "terrain" : name.substr(0, 64);
}

/// Tells inputs and options apart from all others, and from themselves after a change.
Result<std::string> keyOf(const ViewArguments& options, const ImageryOptions& imagery) {
  std::vector<std::string> inputs = options.source.inputs;
  for (const ImageryLayerOptions& layer : imagery.layers)
    inputs.insert(inputs.end(), layer.inputs.begin(), layer.inputs.end());
  TERRANE_ASSIGN(const std::vector<InputFile> files, inputFiles(inputs));
  std::string text = fmt::format("{}\n{} inputs {}\n{}\n", TERRANE_VERSION, options.source.inputs.size(),
                                 describeSource(options.source), describeImagery(options.imagery));
  for (const ImageryLayerOptions& layer : imagery.layers)
    text += fmt::format("{} {}\n", layer.name, layer.inputs.size());
  for (const InputFile& file : files) text += fmt::format("{} {} {}\n", file.path, file.bytes, file.modified);
  return sha256(text);
}

/// The inputs as a dataset in the cache, built where it is not there.
Result<std::string> builtInCache(const ViewArguments& options, const ImageryOptions& imagery,
                                 const CachePlace& place, CommandProgress& progress) {
  BuildOptions build;
  build.output = place.folder() + "/" + nameFor(options.source.inputs) + ".terrane";
  // note: one that an older program made may be refused by this one.
  if (!options.rebuild && Dataset::open(build.output).ok()) return build.output;
  build.overwrite = true;
  build.imagery = imagery;
  build.optionsText = describeSource(options.source);
  if (const std::string text = describeImagery(options.imagery); !text.empty())
    build.optionsText += (build.optionsText.empty() ? "" : " ") + text;
  build.cancel = &interruptFlag();
  TERRANE_ASSIGN(const auto source, openSource(options.source, progress));
  TERRANE_ASSIGN(const BuildReport report, buildDataset(*source, build, progress));
  progress.finish();
  if (!options.output.quiet && !options.output.json)
    std::fprintf(stderr, "terrane: %s: %s, built in %s\n", build.output.c_str(),
                 formatBytes(report.archiveBytes + report.imageryBytes).c_str(),
                 formatDuration(report.seconds).c_str());
  return build.output;
}

/// Asks the desktop to open an address; false where there is none that could.
bool openInBrowser(const std::string& url) {
  const auto isSet = [](const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr && value[0] != '\0';
  };
  if (!isSet("DISPLAY") && !isSet("WAYLAND_DISPLAY")) return false;
  std::string program = "xdg-open";
  std::string address = url;
  char* const arguments[] = {program.data(), address.data(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, descriptor, "/dev/null", O_RDWR, 0);
  // A browser that this starts must end with Ctrl-C in its own terminal only, and may be told to stop.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  std::signal(SIGCHLD, SIG_IGN);
  pid_t process = -1;
  const int trouble = posix_spawnp(&process, program.c_str(), &actions, &attributes, arguments, environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return trouble == 0;
}

Result<std::unique_ptr<serve::HttpServer>> startServer(const ViewArguments& options, serve::Site& site,
                                                       serve::Metrics& metrics) {
  serve::ServerOptions server;
  server.port = options.port.value_or(kUsualPort);
  auto started = serve::HttpServer::start(server, site, metrics);
  if (started.ok() || options.port) return started;
  // The usual port is somebody's; any other will do.
  server.port = 0;
  return serve::HttpServer::start(server, site, metrics);
}

int runView(const ViewArguments& options) {
  serve::SiteOptions siteOptions;
  siteOptions.viewerFolder = options.viewerFolder.empty() ? findViewer() : options.viewerFolder;
  if (siteOptions.viewerFolder.empty()) return fail(makeError("{}", kNoViewer), options.output);
  const auto imagery = parseImagery(options.imagery);
  if (!imagery.ok()) {
    fail(imagery.error(), options.output);
    return kExitUsage;
  }

  const std::vector<std::string>& inputs = options.source.inputs;
  const auto datasets = std::count_if(inputs.begin(), inputs.end(), isDataset);
  if (datasets > 0 && (datasets < static_cast<ptrdiff_t>(inputs.size()) || !imagery->layers.empty() ||
                       !describeSource(options.source).empty())) {
    fail(makeError("a dataset is viewed as it is; view it without rasters and without options for them"),
         options.output);
    return kExitUsage;
  }
  std::optional<CachePlace> place;
  if (datasets > 0) {
    siteOptions.datasets = inputs;
  } else {
    const auto cache = viewCacheFolder();
    if (!cache.ok()) return fail(cache.error(), options.output);
    forgetUnused(*cache, kKeptDays);
    const auto key = keyOf(options, *imagery);
    if (!key.ok()) return fail(key.error(), options.output);
    auto used = CachePlace::use(*cache, *key);
    if (!used.ok()) return fail(used.error(), options.output);
    place.emplace(std::move(used).value());
    const std::unique_ptr<CommandProgress> progress = makeProgress(options.output);
    const auto built = builtInCache(options, *imagery, *place, *progress);
    if (!built.ok()) return fail(built.error(), options.output);
    siteOptions.datasets = {*built};
  }

  const StopSignals signals;
  serve::Metrics metrics;
  const auto site = serve::Site::open(siteOptions, metrics);
  if (!site.ok()) return fail(site.error(), options.output);
  const auto server = startServer(options, **site, metrics);
  if (!server.ok()) return fail(server.error(), options.output);
  const std::string url = (*server)->url();
  if (options.output.json) {
    printJson({{"url", url}, {"datasets", siteOptions.datasets}});
  } else {
    std::printf("%s\n", url.c_str());
  }
  std::fflush(stdout);
  const bool isOpening = !options.noOpen && openInBrowser(url);
  if (!options.output.quiet && !options.output.json)
    std::fprintf(stderr, "terrane: %s; Ctrl-C ends it\n",
                 isOpening ? "the browser is asked to open it" : "open this address in a browser");

  signals.wait();
  (*server)->stop(kGraceSeconds);
  return kExitOk;
}

}  // namespace

void addViewCommand(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("view", "Look at rasters or datasets in the browser");
  command->footer(kViewExamples);
  const auto options = std::make_shared<ViewArguments>();
  command
      ->add_option("INPUT", options->source.inputs,
                   fmt::format("{}; or datasets, NAME.terrane", kInputArgument))
      ->required();
  addSourceOptions(*command, options->source);
  addImageryOptions(*command, options->imagery);
  command
      ->add_option("--port", options->port,
                   fmt::format("The port; 0 for any that is free (default: {}, else any)", kUsualPort))
      ->check(CLI::Range(0, 65535));
  command->add_option("--viewer", options->viewerFolder,
                      "The folder of the viewer; without, that beside this program");
  command->add_flag("--no-open", options->noOpen, "Print the address, open no browser");
  command->add_flag("--rebuild", options->rebuild, "Build again what is in the cache");
  addOutputOptions(*command, options->output);
  command->callback([&context, options] { context.run = [options] { return runView(*options); }; });
}

}  // namespace terrane::cli
