#include "common.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <optional>

#include "terrane/base/format_number.h"
#include "terrane/stream/open_dataset.h"

namespace terrane::cli {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

constexpr const char* kFetching = "fetching";

/// One stage of the work as the user sees it.
struct Stage {
  std::string name;
  std::string unit;
  int64_t total = 0;
  int64_t done = 0;
  uint64_t fetchedBytes = 0;
  Clock::time_point begin;
  bool running = false;
  std::optional<Clock::time_point> lastFetched;

  /// Fetching ends with its last byte.
  double seconds() const {
    return std::chrono::duration<double>((name == kFetching && lastFetched ? *lastFetched : Clock::now()) -
                                         begin)
        .count();
  }
};

class NoProgress final : public CommandProgress {
 public:
  void beginStage(std::string_view, int64_t, std::string_view) override {}
  void advance(int64_t) override {}
  void warn(const std::string& message) override {
    std::fprintf(stderr, "terrane: warning: %s\n", message.c_str());
  }
  void fetched(uint64_t) override {}
  void finish() override {}
};

/// Shared by the kinds that follow stages: counts, and hands over to begin(), update() and end().
class StageProgress : public CommandProgress {
 public:
  void beginStage(std::string_view name, int64_t total, std::string_view unit) final {
    const std::lock_guard lock(mutex_);
    startStage(name, total, unit);
  }
  void advance(int64_t steps) final {
    const std::lock_guard lock(mutex_);
    stage_.done += steps;
    show();
  }
  void fetched(uint64_t bytes) final {
    const std::lock_guard lock(mutex_);
    if (!stage_.running) startStage(kFetching, 0, "kB");
    stage_.fetchedBytes += bytes;
    stage_.lastFetched = Clock::now();
    if (stage_.name == kFetching) stage_.done = static_cast<int64_t>(stage_.fetchedBytes / 1000);
    show();
  }
  void warn(const std::string& message) final {
    const std::lock_guard lock(mutex_);
    warning(message);
  }
  void finish() final {
    const std::lock_guard lock(mutex_);
    endStage();
  }

 protected:
  virtual void begin(const Stage& stage) = 0;
  virtual void update(const Stage& stage) = 0;
  virtual void end(const Stage& stage) = 0;
  virtual void warning(const std::string& message) = 0;

 private:
  void startStage(std::string_view name, int64_t total, std::string_view unit) {
    endStage();
    stage_ = {std::string(name), std::string(unit), total, 0, 0, Clock::now(), true, {}};
    shown_ = Clock::now();
    begin(stage_);
  }
  void endStage() {
    if (stage_.running) end(stage_);
    stage_.running = false;
  }
  void show() {
    if (!stage_.running || secondsSince(shown_) < 0.1) return;
    shown_ = Clock::now();
    update(stage_);
  }
  std::mutex mutex_;
  Stage stage_;
  Clock::time_point shown_ = Clock::now();
};

/// One line that is rewritten while a stage runs: share, rate, time left. Where standard error is not a
/// terminal, one line when a stage ends.
class TerminalProgress final : public StageProgress {
 public:
  explicit TerminalProgress(bool live) : live_(live) {}

 protected:
  void begin(const Stage& stage) override {
    if (live_) update(stage);
  }
  void update(const Stage& stage) override {
    if (!live_) return;
    const double seconds = secondsSince(stage.begin);
    const double share = stage.total > 0 ? std::min(1.0, double(stage.done) / double(stage.total)) : 0.0;
    // How much will come over a line is not known before.
    std::string line = stage.total > 0
                           ? fmt::format("{:<10} {:3.0f} %", stage.name, share * 100.0)
                           : fmt::format("{:<10} {} {}", stage.name, formatCount(stage.done), stage.unit);
    if (stage.done > 0 && seconds > 0.2) {
      line += fmt::format("  {} {}/s", formatCount(std::llround(double(stage.done) / seconds)), stage.unit);
      if (share > 0.0 && share < 1.0)
        line += fmt::format("  {} left", formatDuration(seconds / share - seconds));
    }
    std::fprintf(stderr, "\r\033[K%s", line.c_str());
    std::fflush(stderr);
  }
  void end(const Stage& stage) override {
    std::string line = fmt::format("{:<10} {} {} in {}", stage.name, formatCount(stage.done), stage.unit,
                                   formatDuration(stage.seconds()));
    if (stage.fetchedBytes > 0 && stage.name != kFetching)
      line += fmt::format(", {} fetched", formatBytes(stage.fetchedBytes));
    std::fprintf(stderr, "%s%s\n", live_ ? "\r\033[K" : "", line.c_str());
  }
  void warning(const std::string& message) override {
    std::fprintf(stderr, "%sterrane: warning: %s\n", live_ ? "\r\033[K" : "", message.c_str());
  }

 private:
  bool live_;
};

/// A JSON object for each stage when it ends, and for each warning.
class JsonProgress final : public StageProgress {
 protected:
  void begin(const Stage&) override {}
  void update(const Stage&) override {}
  void end(const Stage& stage) override {
    nlohmann::json line = {
        {"stage", stage.name}, {"steps", stage.done}, {"unit", stage.unit}, {"seconds", stage.seconds()}};
    if (stage.fetchedBytes > 0) line["fetched_bytes"] = stage.fetchedBytes;
    printJson(line);
  }
  void warning(const std::string& message) override { printJson({{"warning", message}}); }
};

std::atomic<bool> interrupted{false};

extern "C" void onInterrupt(int signal) {
  interrupted.store(true);
  std::signal(signal, SIG_DFL);
}

}  // namespace

void addOutputOptions(CLI::App& command, OutputOptions& options) {
  command.add_flag("-q,--quiet", options.quiet, "Say nothing but warnings and errors");
  command.add_flag("--json", options.json, "Print one JSON object a line instead of text");
}

std::unique_ptr<CommandProgress> makeProgress(const OutputOptions& options) {
  if (options.json) return std::make_unique<JsonProgress>();
  if (options.quiet) return std::make_unique<NoProgress>();
  return std::make_unique<TerminalProgress>(isatty(STDERR_FILENO) == 1);
}

Result<Dataset> openDatasetArgument(const std::string& directoryOrUrl, CommandProgress& progress) {
  RemoteOptions remote;
  remote.received = [&progress](uint64_t bytes) { progress.fetched(bytes); };
  remote.trouble = [&progress](const std::string& problem) { progress.warn(problem); };
  return openDataset(directoryOrUrl, remote);
}

int fail(const Error& error, const OutputOptions& options) {
  std::fprintf(stderr, "terrane: %s\n", error.message.c_str());
  if (options.json) printJson({{"error", error.message}});
  return kExitFailed;
}

void printJson(const nlohmann::json& object) {
  // File names need not be UTF-8; JSON must be.
  const std::string line = object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::printf("%s\n", line.c_str());
  std::fflush(stdout);
}

Result<uint64_t> parseByteSize(const std::string& text) {
  const auto wrong = [&] {
    return makeError("'{}' is no size in bytes; write it like 500M, 2G or 1.5G", text);
  };
  char* rest = nullptr;
  const double number = std::strtod(text.c_str(), &rest);
  if (rest == text.c_str() || !std::isfinite(number) || number <= 0.0) return wrong();

  // A unit letter, perhaps followed by "B" or "iB".
  std::string unit(rest);
  for (char& c : unit) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  double factor = 1.0;
  if (!unit.empty() && unit != "B") {
    const size_t power = std::string("KMGT").find(unit[0]);
    const std::string tail = unit.substr(1);
    if (power == std::string::npos || (!tail.empty() && tail != "B" && tail != "IB")) return wrong();
    factor = std::pow(1024.0, static_cast<double>(power) + 1.0);
  }
  if (number * factor < 1.0 || number * factor > 1e18) return wrong();
  return static_cast<uint64_t>(number * factor);
}

ResourceUse resourceUse() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return {static_cast<uint64_t>(usage.ru_maxrss) * 1024, seconds(usage.ru_utime) + seconds(usage.ru_stime)};
}

const std::atomic<bool>& interruptFlag() {
  static const bool installed = [] {
    std::signal(SIGINT, onInterrupt);
    std::signal(SIGTERM, onInterrupt);
    return true;
  }();
  static_cast<void>(installed);
  return interrupted;
}

}  // namespace terrane::cli
