#include "terrane/base/parallel.h"

/// Browsers: one thread, so that pages need no isolation from others (decision 64).
namespace terrane {

int hardwareThreads() {
  return 1;
}

void parallelFor(int64_t count, int /*threads*/, const std::function<void(int64_t)>& body) {
  for (int64_t i = 0; i < count; ++i) body(i);
}

}  // namespace terrane
