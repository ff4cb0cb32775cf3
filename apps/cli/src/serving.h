#pragma once

#include <csignal>
#include <memory>
#include <string>

#include "terrane/base/result.h"
#include "terrane/serve/http_server.h"
#include "terrane/serve/site.h"

namespace terrane::cli {

/// The viewer that lies beside this program: where it was installed, or where it was built. Empty: none.
std::string findViewer();
/// What is said where there is none.
inline constexpr const char* kNoViewer = "there is no viewer beside this program; ./dev build web makes it";

/// SIGINT and SIGTERM, which are waited for and not handled. To be made before the threads that serve, which
/// inherit what is blocked.
class StopSignals {
 public:
  StopSignals();
  /// Returns when one of them has come, to this object or to interruptFlag(); from then on another one ends
  /// the program as it always does.
  void wait() const;

 private:
  sigset_t set_{};
};

}  // namespace terrane::cli
