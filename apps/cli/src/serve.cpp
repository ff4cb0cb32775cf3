#include <fmt/format.h>

#include <cstdio>

#include "commands.h"
#include "common.h"
#include "serving.h"
#include "terrane/serve/access_log.h"
#include "terrane/serve/http_server.h"
#include "terrane/serve/site.h"

namespace terrane::cli {
namespace {

constexpr const char* kServeExamples =
    "Examples:\n"
    "  terrane serve alps.terrane                          open http://127.0.0.1:8080/ and fly\n"
    "  terrane serve *.terrane --port 0                    at any free port; the URL is printed\n"
    "  terrane serve alps.terrane --cors                   pages of other sites may read it, too\n"
    "  terrane serve alps.terrane --bind 0.0.0.0 --access-log access.log\n"
    "  curl 'http://127.0.0.1:8080/d/alps/elevation?points=7.66,45.98&crs=EPSG:4326'\n"
    "\n"
    "docs/serving.md lists every URL. SIGTERM or Ctrl-C lets what runs finish; a second one ends at once.";

struct ServeArguments {
  bool noViewer = false;
  serve::SiteOptions site;
  serve::ServerOptions server;
  std::string accessLog;
  std::string cache = "256M";
  double graceSeconds = 10.0;
  bool quiet = false;
};

int runServe(ServeArguments options) {
  OutputOptions output;
  const auto cacheBytes = parseByteSize(options.cache);
  if (!cacheBytes.ok()) return fail(makeError("--cache: {}", cacheBytes.error().message), output);
  options.site.cacheBytes = *cacheBytes;

  if (options.noViewer) options.site.viewerFolder.clear();
  const bool isBeside = !options.noViewer && options.site.viewerFolder.empty();
  if (isBeside) options.site.viewerFolder = findViewer();
  if (isBeside && options.site.viewerFolder.empty() && !options.quiet)
    std::fprintf(stderr, "terrane: %s\n", kNoViewer);

  const StopSignals signals;
  serve::Metrics metrics;
  const auto site = serve::Site::open(options.site, metrics);
  if (!site.ok()) return fail(site.error(), output);
  std::unique_ptr<serve::AccessLog> log;
  if (!options.accessLog.empty()) {
    auto opened = serve::AccessLog::open(options.accessLog);
    if (!opened.ok()) return fail(opened.error(), output);
    log = std::move(opened).value();
    options.server.accessLog = log.get();
  }
  const auto server = serve::HttpServer::start(options.server, **site, metrics);
  if (!server.ok()) return fail(server.error(), output);

  if (!options.quiet) {
    for (const auto& dataset : (*site)->datasets())
      std::fprintf(stderr, "terrane: serving %s at %s%s\n", dataset.name.c_str(), (*server)->url().c_str(),
                   dataset.path.c_str());
  }
  std::printf("%s\n", (*server)->url().c_str());
  std::fflush(stdout);

  signals.wait();
  if (!options.quiet) std::fprintf(stderr, "terrane: stopping\n");
  (*server)->stop(options.graceSeconds);
  return kExitOk;
}

}  // namespace

void addServeCommand(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("serve", "Serve datasets over HTTP");
  command->footer(kServeExamples);
  const auto options = std::make_shared<ServeArguments>();
  serve::ServerLimits& limits = options->server.limits;
  command->add_option("DATASET", options->site.datasets, "Datasets, NAME.terrane")->required();
  command
      ->add_option("--bind", options->server.bindAddress,
                   "The IP address to listen at; 0.0.0.0 or :: for all")
      ->capture_default_str();
  command->add_option("--port", options->server.port, "The port; 0 for any that is free (the URL is printed)")
      ->capture_default_str()
      ->check(CLI::Range(0, 65535));
  command
      ->add_option("--cors", options->site.corsOrigin,
                   "Let pages of this origin read what is served (\"https://example.org\"); alone: of any")
      ->expected(0, 1)
      ->default_str("*");
  CLI::Option* viewer = command->add_option("--viewer", options->site.viewerFolder,
                                            "The folder of the viewer; without, that beside this program");
  command->add_flag("--no-viewer", options->noViewer, "A plain page in place of the viewer")
      ->excludes(viewer);
  command->add_option("--threads", options->server.threads, "Threads that serve; 0 for as many as cores")
      ->capture_default_str()
      ->check(CLI::Range(0, 256));
  command->add_option("--access-log", options->accessLog,
                      "Write a line for each request here; - for standard output");
  command->add_option("--cache", options->cache, "Memory for decoded tiles, as 512M or 2G")
      ->capture_default_str();
  command->add_option("--grace", options->graceSeconds, "Seconds that running answers may take after SIGTERM")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 3600.0));
  command->add_flag("-q,--quiet", options->quiet, "Print nothing but the URL and errors");

  const std::string group = "Limits";
  command->add_option("--max-connections", limits.connections, "Connections at a time; more are told 503")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000))
      ->group(group);
  command->add_option("--max-request-line", limits.requestLineBytes, "Bytes of a request's first line")
      ->capture_default_str()
      ->check(CLI::Range(256, 1 << 20))
      ->group(group);
  command->add_option("--max-head", limits.headBytes, "Bytes of a request's first line and fields")
      ->capture_default_str()
      ->check(CLI::Range(1024, 1 << 20))
      ->group(group);
  command->add_option("--max-body", limits.bodyBytes, "Bytes of a question that is posted")
      ->capture_default_str()
      ->check(CLI::Range(0, 64 << 20))
      ->group(group);
  command->add_option("--head-timeout", limits.headSeconds, "Seconds for a request's head to arrive")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 3600.0))
      ->group(group);
  command->add_option("--body-timeout", limits.bodySeconds, "Seconds for a request's body to arrive")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 3600.0))
      ->group(group);
  command
      ->add_option("--idle-timeout", limits.idleSeconds,
                   "Seconds that a connection may wait for its next request, or take nothing of an answer")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 3600.0))
      ->group(group);
  command->callback([&context, options] { context.run = [options] { return runServe(*options); }; });
}

}  // namespace terrane::cli
