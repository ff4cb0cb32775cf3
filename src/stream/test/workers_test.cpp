#include "terrane/stream/workers.h"

#include <gtest/gtest.h>

#include <vector>

namespace terrane {
namespace {

TEST(SlicedWorkers, DoJobsWhenToldInTheirOrder) {
  SlicedWorkers workers;
  std::vector<int> done;
  for (int i = 0; i < 5; ++i) workers.submit([&done, i] { done.push_back(i); });
  EXPECT_TRUE(done.empty());
  // A slice without time is one job.
  EXPECT_EQ(workers.work(0.0), 1);
  EXPECT_EQ(done, (std::vector<int>{0}));
  EXPECT_EQ(workers.work(1e9), 4);
  EXPECT_EQ(done, (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_TRUE(workers.isIdle());
  EXPECT_EQ(workers.work(1e9), 0);
}

TEST(SlicedWorkers, AJobMaySubmitOthers) {
  SlicedWorkers workers;
  int done = 0;
  workers.submit([&] {
    ++done;
    workers.submit([&] { ++done; });
  });
  EXPECT_EQ(workers.work(1e9), 2);
  EXPECT_EQ(done, 2);
}

}  // namespace
}  // namespace terrane
