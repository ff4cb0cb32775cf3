#include "terrane/stream/plan_requests.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace terrane {
namespace {

TEST(PlanRequests, NeighboursComeTogetherTheMostUrgentFirst) {
  // Wanted in this order: one far away, then three that lie side by side.
  const std::vector<FetchCandidate> candidates = {{0, 900000, 100, 9.0, false}, {0, 1000, 500, 5.0, false},
                                                  {0, 2000, 500, 4.0, false},   {0, 1500, 500, 3.0, false},
                                                  {1, 1500, 500, 2.9, false},   {0, 60000, 10, 2.0, false}};
  const auto plan = planRequests(candidates, {.bytes = 100000, .requests = 8});
  ASSERT_EQ(plan.size(), 4U);
  EXPECT_EQ(plan[0].offset, 900000U);
  EXPECT_EQ(plan[1].offset, 1000U);
  EXPECT_EQ(plan[1].bytes, 1500U);
  EXPECT_EQ(plan[1].candidates, (std::vector<size_t>{1, 3, 2}));
  EXPECT_EQ(plan[2].file, 1);
  EXPECT_EQ(plan[3].offset, 60000U);
}

TEST(PlanRequests, WhatIsWorthLittleOrAskedForAloneDoesNotComeAlong) {
  const std::vector<FetchCandidate> candidates = {
      {0, 1000, 500, 5.0, false}, {0, 1500, 500, 4.0, true}, {0, 500, 500, 0.1, false}};
  const auto plan = planRequests(candidates, {.bytes = 100000, .requests = 1});
  ASSERT_EQ(plan.size(), 1U);
  EXPECT_EQ(plan[0].bytes, 500U);
}

TEST(PlanRequests, WhatTheLineBringsQuicklyComesAlongWhateverItIsWorth) {
  const std::vector<FetchCandidate> candidates = {{0, 1000, 500, 5.0, false}, {0, 1500, 500, 0.1, false}};
  RequestLimits limits{.bytes = 100000, .requests = 1};
  limits.easyBytes = 999;
  EXPECT_EQ(planRequests(candidates, limits)[0].bytes, 500U);
  limits.easyBytes = 1000;
  EXPECT_EQ(planRequests(candidates, limits)[0].bytes, 1000U);
}

TEST(PlanRequests, WhatMayWaitStartsWhenItIsEnoughOrJoinsWhatMayNot) {
  std::vector<FetchCandidate> candidates = {
      {0, 1000, 500, 5.0, false, true}, {0, 1500, 500, 4.0, false, true}, {0, 90000, 500, 3.0, false, true}};
  RequestLimits limits{.bytes = 100000, .requests = 8};
  limits.worthStarting = 1000;
  auto plan = planRequests(candidates, limits);
  ASSERT_EQ(plan.size(), 1U);
  EXPECT_EQ(plan[0].candidates, (std::vector<size_t>{0, 1}));
  limits.worthStarting = 1001;
  EXPECT_TRUE(planRequests(candidates, limits).empty());
  // One of them that may not takes its neighbour with it.
  candidates[1].mayWait = false;
  plan = planRequests(candidates, limits);
  ASSERT_EQ(plan.size(), 1U);
  EXPECT_EQ(plan[0].candidates, (std::vector<size_t>{0, 1}));
}

TEST(PlanRequests, WhatOnlyComesAlongStartsNothing) {
  std::vector<FetchCandidate> candidates = {{0, 1000, 500, 5.0, false, false, false},
                                            {0, 1500, 500, 5.0, false, true, true},
                                            {0, 90000, 500, 5.0, false, true, true}};
  const auto plan = planRequests(candidates, {.bytes = 100000, .requests = 8});
  ASSERT_EQ(plan.size(), 1U);
  EXPECT_EQ(plan[0].bytes, 1000U);
}

TEST(PlanRequests, RandomCandidatesAreEachAskedForOnceWithinTheLimits) {
  for (uint32_t seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    std::vector<FetchCandidate> candidates;
    std::array<uint64_t, 3> end{};
    for (int i = 0; i < 60; ++i) {
      const auto file = static_cast<size_t>(random() % 3);
      const uint64_t bytes = 1 + random() % 20000;
      end[file] += random() % 3 == 0 ? random() % 9000 : 0;
      candidates.push_back({static_cast<int>(file), end[file], bytes,
                            1.0 + static_cast<double>(random() % 100), random() % 10 == 0});
      end[file] += bytes;
    }
    std::shuffle(candidates.begin(), candidates.end(), random);
    RequestLimits limits{.bytes = random() % 300000, .requests = static_cast<int>(random() % 9)};
    limits.bytesARequest = 50000;
    const auto plan = planRequests(candidates, limits);
    EXPECT_LE(static_cast<int>(plan.size()), limits.requests);
    std::set<size_t> seen;
    uint64_t before = 0;
    for (const PlannedRequest& request : plan) {
      EXPECT_TRUE(before < limits.bytes || before == 0) << seed;
      before += request.bytes;
      EXPECT_LE(request.bytes, limits.bytesARequest);
      for (const size_t index : request.candidates) {
        EXPECT_TRUE(seen.insert(index).second);
        const FetchCandidate& candidate = candidates[index];
        EXPECT_EQ(candidate.file, request.file);
        EXPECT_GE(candidate.offset, request.offset);
        EXPECT_LE(candidate.offset + candidate.bytes, request.offset + request.bytes);
        EXPECT_TRUE(!candidate.alone || request.candidates.size() == 1);
      }
    }
    // The first of all is never passed over.
    if (limits.requests > 0) {
      EXPECT_EQ(seen.count(0), 1U);
    }
  }
}

}  // namespace
}  // namespace terrane
