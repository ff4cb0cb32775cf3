#include "terrane/stream/workers.h"

#include <gtest/gtest.h>

#include <vector>

namespace terrane {
namespace {

/// Twice a number.
struct Double {
  static constexpr uint32_t kKind = 1000;
  using Answer = int;
  int number = 0;
  int run() const { return 2 * number; }
  void pack(Packer& packer) const { packer.value(number); }
  static Double unpack(Unpacker& unpacker) { return {unpacker.value<int>()}; }
  static void packAnswer(Packer& packer, int answer) { packer.value(answer); }
  static int unpackAnswer(Unpacker& unpacker) { return unpacker.value<int>(); }
};

TEST(SlicedWorkers, WorkWhenToldInTheOrderInWhichItCame) {
  SlicedWorkers workers;
  std::vector<int> done;
  for (int i = 0; i < 5; ++i) workers.order(Double{i}, [&done](int answer) { done.push_back(answer); });
  EXPECT_TRUE(done.empty());
  // A slice without time is one piece of work.
  EXPECT_EQ(workers.work(0.0), 1);
  EXPECT_EQ(done, (std::vector<int>{0}));
  EXPECT_EQ(workers.work(1e9), 4);
  EXPECT_EQ(done, (std::vector<int>{0, 2, 4, 6, 8}));
  EXPECT_TRUE(workers.isIdle());
  EXPECT_EQ(workers.work(1e9), 0);
}

TEST(SlicedWorkers, WhoTakesAnAnswerMayOrderMore) {
  SlicedWorkers workers;
  std::vector<int> done;
  workers.order(Double{1}, [&](int answer) {
    done.push_back(answer);
    workers.order(Double{answer}, [&done](int next) { done.push_back(next); });
  });
  EXPECT_EQ(workers.work(1e9), 2);
  EXPECT_EQ(done, (std::vector<int>{2, 4}));
}

TEST(SlicedWorkers, GiveAwayWhatWaitsAndTakeItBack) {
  SlicedWorkers workers;
  std::vector<int> done;
  for (int i = 0; i < 3; ++i) workers.order(Double{i}, [&done](int answer) { done.push_back(answer); });
  std::unique_ptr<Work> first = workers.takeFirst();
  std::unique_ptr<Work> second = workers.takeFirst();
  second->run();
  workers.putFirst(std::move(first));
  EXPECT_EQ(workers.work(1e9), 2);
  EXPECT_EQ(done, (std::vector<int>{2, 0, 4}));
  EXPECT_EQ(workers.takeFirst(), nullptr);
}

/// As a worker with a memory of its own does it: the order goes there as bytes, the answer comes back so.
TEST(Work, TravelsAsBytes) {
  int taken = 0;
  const auto take = [&taken](int answer) { taken = answer; };
  OrderedWork work(Double{21}, take);
  EXPECT_EQ(work.kind(), 1000U);
  Packer order, answer;
  work.pack(order);
  const Status ran = runPacked<Double>(order.bytes(), answer);
  ASSERT_TRUE(ran.ok()) << ran.error().message;
  ASSERT_TRUE(work.takeAnswer(answer.bytes()).ok());
  EXPECT_EQ(taken, 42);

  // Bytes that are none do nothing.
  taken = 0;
  order.value<uint8_t>(0);
  answer.clear();
  EXPECT_FALSE(runPacked<Double>(order.bytes(), answer).ok());
  EXPECT_TRUE(answer.bytes().empty());
  EXPECT_FALSE(work.takeAnswer(order.bytes()).ok());
  EXPECT_FALSE(work.takeAnswer({}).ok());
  EXPECT_EQ(taken, 0);
}

}  // namespace
}  // namespace terrane
