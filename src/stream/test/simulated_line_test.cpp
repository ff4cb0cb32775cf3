#include "terrane/stream/simulated_line.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "temporary_directory.h"

namespace terrane {
namespace {

constexpr double kHeader = 250.0;

class SimulatedLineTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 20000; ++i) bytes_.push_back(static_cast<char>(i * 37 % 251));
    writeWholeFile(folder_.file("data"), bytes_);
  }
  std::string directory() const {
    const std::string file = folder_.file("data");
    return file.substr(0, file.rfind('/'));
  }
  TemporaryDirectory folder_;
  std::string bytes_;
};

TEST_F(SimulatedLineTest, AnswersComeInOrderAfterLatencyAtTheLinesSpeed) {
  SimulatedLine line(directory(), {10000.0, 0.1});
  line.start(1, {"data", 100, 2000, false});
  line.start(2, {"data", 0, 0, false});
  EXPECT_TRUE(line.poll(0.1 + (kHeader + 2000.0) / 10000.0 - 1e-6).empty());
  auto first = line.poll(0.1 + (kHeader + 2000.0) / 10000.0 + 1e-6);
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(first[0].id, 1U);
  EXPECT_TRUE(std::equal(first[0].bytes.begin(), first[0].bytes.end(), bytes_.begin() + 100,
                         [](uint8_t a, char b) { return a == static_cast<uint8_t>(b); }));
  const double whole = 0.1 + (2.0 * kHeader + 22000.0) / 10000.0;
  EXPECT_TRUE(line.poll(whole - 1e-6).empty());
  EXPECT_EQ(line.poll(whole + 1e-6).size(), 1U);
  EXPECT_EQ(line.bytesDelivered(), 22000U);
}

TEST_F(SimulatedLineTest, WhatIsCancelledTakesNoTimeAndNeverComes) {
  SimulatedLine line(directory(), {10000.0, 0.1});
  line.start(1, {"data", 0, 10000, false});
  line.start(2, {"data", 0, 1000, false});
  EXPECT_TRUE(line.poll(0.2).empty());
  line.cancel(1);
  const auto answers = line.poll(0.2 + (kHeader + 1000.0) / 10000.0 + 1e-6);
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].id, 2U);
}

TEST_F(SimulatedLineTest, FaultsComeInTheirSharesAndAnOutageEnds) {
  LineFaults faults;
  faults.busyShare = faults.truncatedShare = faults.corruptShare = faults.slowShare = 0.1;
  SimulatedLine line(directory(), {1e9, 0.001}, faults);
  std::map<int, int> kinds;
  double now = 0.0;
  for (uint64_t id = 0; id < 2000; ++id) {
    line.start(id, {"data", id, 64, false});
    std::vector<FetchAnswer> answers = line.poll(now += 0.01);
    for (const FetchAnswer& answer : answers) {
      const bool isTrue = !answer.failure && std::equal(answer.bytes.begin(), answer.bytes.end(),
                                                        bytes_.begin() + static_cast<ptrdiff_t>(answer.id),
                                                        [](uint8_t a, char b) { return a == static_cast<uint8_t>(b); });
      ++kinds[answer.failure ? 1 + static_cast<int>(answer.failure->problem) : isTrue ? 0 : -1];
    }
  }
  EXPECT_NEAR(kinds[1 + static_cast<int>(FetchProblem::Busy)], 200, 60);
  EXPECT_NEAR(kinds[1 + static_cast<int>(FetchProblem::Malformed)], 200, 60);
  EXPECT_NEAR(kinds[-1], 200, 60);
  EXPECT_GT(kinds[0], 1200);

  faults = {};
  faults.outages = {{now, now + 5.0}};
  line.setFaults(faults);
  line.start(5000, {"data", 0, 64, false});
  const auto refused = line.poll(now + 1.0);
  const auto isRefused = [](const FetchAnswer& answer) {
    return answer.id == 5000 && answer.failure && answer.failure->problem == FetchProblem::Unreachable;
  };
  EXPECT_TRUE(std::any_of(refused.begin(), refused.end(), isRefused));
  line.poll(now + 6.0);
  line.start(5001, {"data", 0, 64, false});
  const auto back = line.poll(now + 7.0);
  EXPECT_TRUE(std::any_of(back.begin(), back.end(),
                          [](const FetchAnswer& answer) { return answer.id == 5001 && !answer.failure; }));
}

TEST_F(SimulatedLineTest, WhatIsNotThereIsMissing) {
  SimulatedLine line(directory(), {1e9, 0.0});
  line.start(1, {"nothing", 0, 10, false});
  line.start(2, {"data", 19990, 11, false});
  line.start(3, {"data", UINT64_MAX, 11, false});
  for (const FetchAnswer& answer : line.poll(1.0)) {
    ASSERT_TRUE(answer.failure.has_value());
    EXPECT_EQ(answer.failure->problem, FetchProblem::Missing);
  }
}

}  // namespace
}  // namespace terrane
