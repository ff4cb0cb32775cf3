#pragma once

#include <cstdint>
#include <functional>

namespace terrane {

/// Threads that work well side by side on this machine; 1 where there are none.
int hardwareThreads();

/// Calls `body(0)` to `body(count - 1)`, each once, on up to `threads` threads (0: all cores), the calling
/// one included; returns when all are done. `body` must not throw.
void parallelFor(int64_t count, int threads, const std::function<void(int64_t)>& body);

}  // namespace terrane
