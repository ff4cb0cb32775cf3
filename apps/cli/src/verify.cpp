#include "commands.h"
#include "common.h"

namespace terrane::cli {

void addVerifyCommand(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("verify", "verify");
  command->callback([&context] { context.run = [] { return kExitFailed; }; });
}

}  // namespace terrane::cli
