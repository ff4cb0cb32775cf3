#include "serving.h"

#include <pthread.h>

#include <ctime>
#include <filesystem>
#include <system_error>

#include "common.h"

namespace terrane::cli {

namespace fs = std::filesystem;

std::string findViewer() {
  std::error_code trouble;
  const fs::path program = fs::read_symlink("/proc/self/exe", trouble);
  if (trouble) return {};
  const fs::path folder = program.parent_path();
  for (const fs::path& candidate : {folder / "../share/terrane/viewer", folder / "../../viewer"})
    if (fs::is_regular_file(candidate / "index.html", trouble))
      return fs::canonical(candidate, trouble).string();
  return {};
}

StopSignals::StopSignals() {
  sigemptyset(&set_);
  sigaddset(&set_, SIGINT);
  sigaddset(&set_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &set_, nullptr);
}

void StopSignals::wait() const {
  // note: a thread that was started before, by a build, handles a signal in our place and raises the flag.
  const std::atomic<bool>& isInterrupted = interruptFlag();
  const timespec moment{0, 100'000'000};
  while (!isInterrupted && sigtimedwait(&set_, nullptr, &moment) < 0) {
  }
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  pthread_sigmask(SIG_UNBLOCK, &set_, nullptr);
}

}  // namespace terrane::cli
