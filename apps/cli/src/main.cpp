#include <csignal>
#include <cstdio>

#include "commands.h"
#include "common.h"

namespace {

constexpr const char* kDescription =
    "Terrane builds terrain datasets from elevation rasters, and draws them with a known error in pixels.";
constexpr const char* kExamples =
    "Examples:\n"
    "  terrane view *.tif                        look at rasters in the browser, now\n"
    "  terrane build dem.tif -o alps.terrane     make a dataset from a GeoTIFF\n"
    "  terrane info alps.terrane                 say what is in it\n"
    "  terrane render alps.terrane -o alps.png   draw it\n"
    "  terrane serve alps.terrane                serve it over HTTP\n"
    "  terrane verify alps.terrane               check every byte of it\n"
    "\n"
    "`terrane COMMAND --help` explains a command.";

}  // namespace

int main(int argc, char** argv) {
  using namespace terrane::cli;

  // A full disk or a file size limit is an error that we report, never a signal that kills us.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);

  CLI::App app{kDescription, "terrane"};
  app.set_version_flag("--version", "terrane " TERRANE_VERSION);
  app.footer(kExamples);
  app.require_subcommand(1);

  // The subcommands, in the order of --help.
  CommandContext context;
  addViewCommand(app, context);
  addBuildCommand(app, context);
  addInfoCommand(app, context);
  addRenderCommand(app, context);
  addServeCommand(app, context);
  addSynthCommand(app, context);
  addVerifyCommand(app, context);
  addBenchCommand(app, context);

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "terrane: %s\nTry 'terrane --help' or 'terrane COMMAND --help'.\n", error.what());
    return kExitUsage;
  }
  return context.run();
}
