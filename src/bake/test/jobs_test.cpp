#include "jobs.h"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace terrane {
namespace {

namespace fs = std::filesystem;

class JobsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = (fs::path(::testing::TempDir()) / (std::string("terrane-jobs-") + info->name())).string();
    fs::remove(path_);
  }
  void TearDown() override { fs::remove(path_); }
  JobLog open() const {
    auto log = JobLog::open(path_);
    EXPECT_TRUE(log.ok()) << log.error().message;
    return std::move(log).value();
  }
  std::string bytes() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void put(const std::string& bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }

  std::string path_;
};

std::vector<uint8_t> outcomeOf(int64_t job) {
  return std::vector<uint8_t>(static_cast<size_t>(job % 5), static_cast<uint8_t>(job));
}

TEST_F(JobsTest, ALogCutShortAnywhereKeepsWhatIsWhole) {
  constexpr int64_t kJobs = 6;
  std::vector<size_t> ends;
  {
    JobLog log = open();
    EXPECT_TRUE(log.empty());
    for (int64_t job = 0; job < kJobs; ++job) {
      ASSERT_TRUE(log.append(job % 2 == 0 ? "even" : "odd", job, outcomeOf(job)).ok());
      ends.push_back(bytes().size());
    }
    EXPECT_FALSE(log.empty());
    EXPECT_FALSE(log.resumes());
  }
  const std::string whole = bytes();
  for (size_t length = 0; length <= whole.size(); ++length) {
    put(whole.substr(0, length));
    const auto kept = static_cast<int64_t>(
        std::count_if(ends.begin(), ends.end(), [&](size_t end) { return end <= length; }));
    {
      JobLog log = open();
      EXPECT_EQ(log.resumes(), kept > 0);
      const auto even = log.finished("even");
      const auto odd = log.finished("odd");
      ASSERT_EQ(static_cast<int64_t>(even.size() + odd.size()), kept);
      for (const auto& finished : {even, odd}) {
        for (const JobLog::Finished& job : finished) {
          EXPECT_EQ(std::vector<uint8_t>(job.outcome.begin(), job.outcome.end()), outcomeOf(job.job));
        }
      }
      EXPECT_TRUE(log.finished("none").empty());
      // What comes after a torn end is found again.
      ASSERT_TRUE(log.append("after", 77, outcomeOf(3)).ok());
    }
    const JobLog log = open();
    ASSERT_EQ(log.finished("after").size(), 1U);
    EXPECT_EQ(static_cast<int64_t>(log.finished("even").size() + log.finished("odd").size()), kept);
  }
}

TEST_F(JobsTest, AChangedByteDropsItsRecordAndWhatFollows) {
  {
    JobLog log = open();
    for (int64_t job = 0; job < 4; ++job) ASSERT_TRUE(log.append("stage", job, outcomeOf(4)).ok());
  }
  const std::string whole = bytes();
  const size_t each = whole.size() / 4;
  for (size_t at = 0; at < whole.size(); ++at) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 0x40);
    put(changed);
    EXPECT_EQ(open().finished("stage").size(), at / each) << "byte " << at;
  }
}

TEST_F(JobsTest, RunsEachJobOnceHoweverOftenItIsInterrupted) {
  constexpr int64_t kJobs = 200;
  const Workers workers(3, nullptr);
  std::vector<std::atomic<int>> runs(kJobs);
  int64_t resumedBefore = -1;
  for (int64_t attempt = 0;; ++attempt) {
    ASSERT_LT(attempt, 20);
    JobLog log = open();
    Jobs jobs(workers, &log);
    std::atomic<int64_t> begun{0};
    const auto done = jobs.run<int64_t>("squares 1", kJobs, nullptr, [&](int, int64_t i) -> Result<int64_t> {
      if (begun.fetch_add(1) == 23) return makeError("out of luck");
      ++runs[static_cast<size_t>(i)];
      return i * i;
    });
    ASSERT_EQ(jobs.reports().size(), 1U);
    EXPECT_EQ(jobs.reports()[0].name, "squares");
    EXPECT_GT(jobs.reports()[0].jobsResumed, resumedBefore);
    EXPECT_EQ(jobs.reports()[0].jobsDone + jobs.reports()[0].jobsResumed, kJobs);
    resumedBefore = jobs.reports()[0].jobsResumed;
    if (!done.ok()) continue;
    for (int64_t i = 0; i < kJobs; ++i) {
      EXPECT_EQ((*done)[static_cast<size_t>(i)], i * i);
      EXPECT_EQ(runs[static_cast<size_t>(i)], 1);
    }
    EXPECT_GE(attempt, 5);
    break;
  }
}

TEST_F(JobsTest, AppendsInOrderAndGoesOnWhereItStopped) {
  constexpr int64_t kJobs = 100;
  const Workers workers(3, nullptr);
  std::vector<int64_t> appended;
  for (int attempt = 0;; ++attempt) {
    ASSERT_LT(attempt, 20);
    JobLog log = open();
    Jobs jobs(workers, &log);
    int left = 17;
    const Status done = jobs.runInOrder<int64_t>(
        "list", kJobs, nullptr,
        [&](std::span<const int64_t> before) -> Status {
          EXPECT_EQ(std::vector<int64_t>(before.begin(), before.end()), appended);
          return {};
        },
        [](int, int64_t i) -> Result<std::vector<uint8_t>> {
          return std::vector<uint8_t>{static_cast<uint8_t>(i)};
        },
        [&](int64_t i, const std::vector<uint8_t>& made) -> Result<int64_t> {
          if (left-- == 0) return makeError("out of luck");
          EXPECT_EQ(made[0], i);
          appended.push_back(3 * i);
          return 3 * i;
        });
    if (done.ok()) break;
  }
  ASSERT_EQ(appended.size(), static_cast<size_t>(kJobs));
  for (int64_t i = 0; i < kJobs; ++i) EXPECT_EQ(appended[static_cast<size_t>(i)], 3 * i);
}

TEST_F(JobsTest, NeedsNoLog) {
  const Workers workers(1, nullptr);
  Jobs jobs(workers, nullptr);
  const auto done = jobs.run<int>("plain", 3, nullptr,
                                  [](int, int64_t i) -> Result<int> { return static_cast<int>(i) + 1; });
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(*done, (std::vector<int>{1, 2, 3}));
}

}  // namespace
}  // namespace terrane
