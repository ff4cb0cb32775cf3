#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "terrane/base/progress.h"
#include "terrane/base/result.h"
#include "terrane/dataset/dataset.h"

/// What the subcommands share: how they talk and how they end.
namespace terrane::cli {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFailed = 1;  ///< the work could not be done, or a check found faults
inline constexpr int kExitUsage = 2;   ///< the command line makes no sense

/// How a subcommand talks.
struct OutputOptions {
  bool quiet = false;  ///< nothing but errors
  bool json = false;   ///< one JSON object a line on standard output, nothing else there
};

/// Adds -q/--quiet and --json.
void addOutputOptions(CLI::App& command, OutputOptions& options);

/// Progress as the user wants it: a live line on a terminal, a line a stage where standard error is none,
/// JSON lines, or nothing. `finish()` ends the last stage; call it before printing a result.
class CommandProgress : public Progress {
 public:
  /// So much more has come over a line. Where no stage is under way, that is one: "fetching".
  virtual void fetched(uint64_t bytes) = 0;
  virtual void finish() = 0;
};
std::unique_ptr<CommandProgress> makeProgress(const OutputOptions& options);

/// Opens DATASET, a directory or an address; what comes over a line, and trouble there, is told to
/// `progress`, which must outlive the dataset.
Result<Dataset> openDatasetArgument(const std::string& directoryOrUrl, CommandProgress& progress);
/// What --help says of such a DATASET.
inline constexpr const char* kDatasetArgument = "the dataset's directory, or its address (http://, https://)";

/// Says "terrane: message" on standard error, with --json also {"error": message} on standard output; gives
/// kExitFailed.
int fail(const Error& error, const OutputOptions& options);

/// Prints one JSON object on a line of its own.
void printJson(const nlohmann::json& object);

/// "2G", "500M", "1.5GiB", "4096": bytes, in powers of 1024.
Result<uint64_t> parseByteSize(const std::string& text);

/// What the program has taken so far.
struct ResourceUse {
  uint64_t peakRssBytes = 0;
  double cpuSeconds = 0.0;  ///< of all threads, in the program and in the system on its behalf
};
ResourceUse resourceUse();

/// Becomes true when the user interrupts (SIGINT, SIGTERM) after the first call; a second signal kills.
const std::atomic<bool>& interruptFlag();

}  // namespace terrane::cli
