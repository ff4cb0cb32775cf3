#pragma once

#include <array>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "job_log.h"
#include "terrane/bake/build.h"
#include "terrane/base/progress.h"
#include "workers.h"

namespace terrane {

/// What a job leaves that nobody asks for.
struct Done {
  uint8_t nothing = 0;
};

/// Runs the jobs of a build's stages, each once: a job that the log knows as done is not run again, what came
/// of it is told instead. Who runs the jobs is the Workers' business; which jobs there are, and in which
/// order, is the stage's.
///
/// What a job must keep to, so that it may be killed at any moment and run again: it writes only where no
/// other job of its stage writes and where neither it nor a stage before it reads, and all that the rest of
/// the build must know of it lies in these files or in its outcome. Stages must come in the same order, with
/// the same number of jobs, whenever the same build is run.
class Jobs {
 public:
  /// `log` may be null: then nothing is remembered. Both must outlive this.
  Jobs(const Workers& workers, JobLog* log) : workers_(workers), log_(log) {}

  const Workers& workers() const { return workers_; }
  /// What was run and what was not, stage by stage.
  const std::vector<StageReport>& reports() const { return reports_; }

  /// Runs job(worker, i) for every i below `jobs`, side by side, and gives their outcomes in the order of i.
  /// T: plain values without padding that matters, the same on every run. `progress` may be null; it is
  /// advanced by one for every job. `stage`: a name, perhaps a blank and a number; unique within the build.
  template <class T>
  Result<std::vector<T>> run(const std::string& stage, int64_t jobs, Progress* progress,
                             const std::function<Result<T>(int worker, int64_t i)>& job) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<T> outcomes(static_cast<size_t>(jobs));
    const Status done = runBytes(
        stage, jobs, progress,
        [&](int64_t i, std::span<const uint8_t> bytes) {
          if (bytes.size() == sizeof(T))
            std::memcpy(&outcomes[static_cast<size_t>(i)], bytes.data(), sizeof(T));
          return bytes.size() == sizeof(T);
        },
        [&](int worker, int64_t i) -> Result<std::span<const uint8_t>> {
          T& outcome = outcomes[static_cast<size_t>(i)];
          TERRANE_ASSIGN(outcome, job(worker, i));
          return std::span<const uint8_t>(reinterpret_cast<const uint8_t*>(&outcome), sizeof(T));
        });
    TERRANE_TRY(done);
    return outcomes;
  }

  /// Jobs of which nothing is to be told.
  Status run(const std::string& stage, int64_t jobs, Progress* progress,
             const std::function<Status(int worker, int64_t i)>& job) {
    const auto done = run<Done>(stage, jobs, progress, [&](int worker, int64_t i) -> Result<Done> {
      TERRANE_TRY(job(worker, i));
      return Done{};
    });
    return done.ok() ? Status() : Status(done.error());
  }

  /// Jobs whose results go somewhere in ascending order: make(worker, i) side by side, append(i, made) one at
  /// a time, which gives what the log shall hold. The first jobs, those done before, are handed to
  /// replay(their outcomes, in order) before all else.
  template <class T>
  Status runInOrder(const std::string& stage, int64_t jobs, Progress* progress,
                    const std::function<Status(std::span<const T> before)>& replay,
                    const std::function<Result<std::vector<uint8_t>>(int worker, int64_t i)>& make,
                    const std::function<Result<T>(int64_t i, std::vector<uint8_t> made)>& append) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<T> before;
    for (const JobLog::Finished& finished : finishedOf(stage)) {
      if (finished.job != static_cast<int64_t>(before.size()) || finished.outcome.size() != sizeof(T)) break;
      T outcome;
      std::memcpy(&outcome, finished.outcome.data(), sizeof(T));
      before.push_back(outcome);
    }
    TERRANE_CHECK(static_cast<int64_t>(before.size()) <= jobs, "{} jobs of {} in {}", before.size(), jobs,
                  stage);
    TERRANE_TRY(replay(before));
    return runInOrderBytes(stage, jobs, static_cast<int64_t>(before.size()), progress, make,
                           [&](int64_t i, std::vector<uint8_t> made) -> Result<std::vector<uint8_t>> {
                             TERRANE_ASSIGN(const T outcome, append(i, std::move(made)));
                             const auto* bytes = reinterpret_cast<const uint8_t*>(&outcome);
                             return std::vector<uint8_t>(bytes, bytes + sizeof(T));
                           });
  }

 private:
  std::vector<JobLog::Finished> finishedOf(const std::string& stage) const;
  Status runBytes(const std::string& stage, int64_t jobs, Progress* progress,
                  const std::function<bool(int64_t i, std::span<const uint8_t> outcome)>& tell,
                  const std::function<Result<std::span<const uint8_t>>(int worker, int64_t i)>& job);
  Status runInOrderBytes(
      const std::string& stage, int64_t jobs, int64_t first, Progress* progress,
      const std::function<Result<std::vector<uint8_t>>(int worker, int64_t i)>& make,
      const std::function<Result<std::vector<uint8_t>>(int64_t i, std::vector<uint8_t> made)>& append);
  void report(const std::string& stage, int64_t done, int64_t resumed);

  const Workers& workers_;
  JobLog* log_;
  std::vector<StageReport> reports_;
};

}  // namespace terrane
