#include <gtest/gtest.h>

#include <thread>

#include "small_dataset.h"

namespace terrane {
namespace {

using DatasetThreadsTest = DatasetTest;

TEST_F(DatasetThreadsTest, ManyThreadsReadAtOnce) {
  const auto dataset = Dataset::open(directory_.file(""));
  ASSERT_TRUE(dataset.ok());
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 500; ++i) EXPECT_EQ(dataset->readElevation({0, 0, 0}).value()->size(), 3U);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(dataset->bytesRead(), 4U * 500U * 3U);
}

}  // namespace
}  // namespace terrane
