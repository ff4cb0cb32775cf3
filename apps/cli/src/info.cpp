#include "commands.h"
#include "common.h"

namespace terrane::cli {

void addInfoCommand(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("info", "info");
  command->callback([&context] { context.run = [] { return kExitFailed; }; });
}

}  // namespace terrane::cli
