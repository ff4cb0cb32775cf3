#include "terrane/base/parallel.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace terrane {

int hardwareThreads() {
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void parallelFor(int64_t count, int threads, const std::function<void(int64_t)>& body) {
  std::atomic<int64_t> next{0};
  const auto work = [&] {
    for (int64_t i = next++; i < count; i = next++) body(i);
  };
  const int64_t wanted = std::min<int64_t>(threads > 0 ? threads : hardwareThreads(), count);
  std::vector<std::thread> others;
  for (int64_t i = 1; i < wanted; ++i) others.emplace_back(work);
  work();
  for (std::thread& other : others) other.join();
}

}  // namespace terrane
