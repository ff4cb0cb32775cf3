#include "terrane/base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

namespace terrane {
namespace {

TEST(ParallelFor, VisitsEveryIndexOnce) {
  for (const int threads : {0, 1, 3, 16}) {
    std::vector<std::atomic<int>> visits(1000);
    parallelFor(1000, threads, [&](int64_t i) { ++visits[static_cast<size_t>(i)]; });
    for (const auto& count : visits) EXPECT_EQ(count.load(), 1);
  }
  parallelFor(0, 4, [](int64_t) { FAIL(); });
}

}  // namespace
}  // namespace terrane
