#include "commands.h"
#include "common.h"

namespace terrane::cli {

void addBuildCommand(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("build", "build");
  command->callback([&context] { context.run = [] { return kExitFailed; }; });
}

}  // namespace terrane::cli
