#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

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

/// "nan" and "inf" pass every check of a range; only --nodata means anything by them.
void refuseWhatIsNoNumber(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_type_name().rfind("FLOAT", 0) != 0 || option->check_lname("nodata")) continue;
    for (const std::string& text : option->results())
      if (!std::isfinite(std::strtod(text.c_str(), nullptr)))
        throw CLI::ValidationError(option->get_name() + " " + text, "expected a finite number");
  }
}

/// Why the command line could not be read.
std::string explained(const CLI::ParseError& error, int argc, char** argv) {
  const bool isUnknown = argc > 1 && argv[1][0] != '-' &&
                         dynamic_cast<const CLI::RequiredError*>(&error) != nullptr &&
                         std::string(error.what()).find("subcommand") != std::string::npos;
  return isUnknown ? std::string("there is no command '") + argv[1] + "'" : error.what();
}

/// The exit status, or a failure where what was printed could not be written. A reader that has seen enough
/// (`| head`) is none.
int afterFlush(int status) {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return status;
  struct stat output {};
  if (::fstat(STDOUT_FILENO, &output) == 0 && S_ISFIFO(output.st_mode)) return status;
  std::fprintf(stderr, "terrane: standard output cannot be written: %s; give it room, or another place\n",
               errno == 0 ? "it was refused" : std::strerror(errno));
  return status == terrane::cli::kExitOk ? terrane::cli::kExitFailed : status;
}

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
    for (const CLI::App* command : app.get_subcommands()) refuseWhatIsNoNumber(*command);
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "terrane: %s\nTry 'terrane --help' or 'terrane COMMAND --help'.\n",
                 explained(error, argc, argv).c_str());
    return kExitUsage;
  }
  return afterFlush(context.run());
}
