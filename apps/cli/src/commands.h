#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

/// One subcommand is one file: it declares its options on the App, and leaves what is to be done in the
/// context. To add one: write `NAME.cpp` with `addNameCommand`, declare it here, call it in main.cpp and list
/// the file in CMakeLists.txt.
namespace terrane::cli {

/// What `main` needs from the subcommand that was chosen.
struct CommandContext {
  /// Runs the chosen subcommand, gives the exit status (see exit_status.h). Set in the callback of its App.
  std::function<int()> run;
};

void addBenchCommand(CLI::App& app, CommandContext& context);
void addBuildCommand(CLI::App& app, CommandContext& context);
void addInfoCommand(CLI::App& app, CommandContext& context);
void addRenderCommand(CLI::App& app, CommandContext& context);
void addServeCommand(CLI::App& app, CommandContext& context);
void addSynthCommand(CLI::App& app, CommandContext& context);
void addVerifyCommand(CLI::App& app, CommandContext& context);
void addViewCommand(CLI::App& app, CommandContext& context);

}  // namespace terrane::cli
