#include "jobs.h"

namespace terrane {

std::vector<JobLog::Finished> Jobs::finishedOf(const std::string& stage) const {
  return log_ != nullptr ? log_->finished(stage) : std::vector<JobLog::Finished>();
}

Status Jobs::runBytes(const std::string& stage, int64_t jobs, Progress* progress,
                      const std::function<bool(int64_t, std::span<const uint8_t>)>& tell,
                      const std::function<Result<std::span<const uint8_t>>(int, int64_t)>& job) {
  // What was done before is told; the rest is left to do, in ascending order.
  std::vector<bool> done(static_cast<size_t>(jobs), false);
  for (const JobLog::Finished& finished : finishedOf(stage)) {
    if (finished.job < 0 || finished.job >= jobs) continue;
    if (tell(finished.job, finished.outcome)) done[static_cast<size_t>(finished.job)] = true;
  }
  std::vector<int64_t> left;
  for (int64_t i = 0; i < jobs; ++i) {
    if (!done[static_cast<size_t>(i)]) left.push_back(i);
  }
  const auto leftCount = static_cast<int64_t>(left.size());
  if (progress != nullptr && leftCount < jobs) progress->advance(jobs - leftCount);
  report(stage, leftCount, jobs - leftCount);

  return workers_.forEach(leftCount, [&](int worker, int64_t k) -> Status {
    const int64_t i = left[static_cast<size_t>(k)];
    TERRANE_ASSIGN(const std::span<const uint8_t> outcome, job(worker, i));
    if (log_ != nullptr) TERRANE_TRY(log_->append(stage, i, outcome));
    if (progress != nullptr) progress->advance(1);
    return {};
  });
}

Status Jobs::runInOrderBytes(
    const std::string& stage, int64_t jobs, int64_t first, Progress* progress,
    const std::function<Result<std::vector<uint8_t>>(int, int64_t)>& make,
    const std::function<Result<std::vector<uint8_t>>(int64_t, std::vector<uint8_t>)>& append) {
  if (progress != nullptr && first > 0) progress->advance(first);
  report(stage, jobs - first, first);
  return workers_.forEachInOrder(
      jobs - first, [&](int worker, int64_t k) { return make(worker, first + k); },
      [&](int64_t k, std::vector<uint8_t> made) -> Status {
        TERRANE_ASSIGN(const std::vector<uint8_t> outcome, append(first + k, std::move(made)));
        if (log_ != nullptr) TERRANE_TRY(log_->append(stage, first + k, outcome));
        if (progress != nullptr) progress->advance(1);
        return {};
      });
}

void Jobs::report(const std::string& stage, int64_t done, int64_t resumed) {
  // The levels of one step are one line.
  const std::string name = stage.substr(0, stage.find(' '));
  for (StageReport& known : reports_) {
    if (known.name != name) continue;
    known.jobsDone += done;
    known.jobsResumed += resumed;
    return;
  }
  reports_.push_back({name, done, resumed});
}

}  // namespace terrane
