#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "terrane/base/result.h"

namespace terrane {

/// The threads that a build works with, and the one place where "which jobs, in which order" meets "who runs
/// them".
class Workers {
 public:
  /// `threads` 0: all cores. `cancel` may be null; once it is true, work ends with an error soon.
  Workers(int threads, const std::atomic<bool>* cancel);

  int count() const { return count_; }
  /// The error that says so, once the user has interrupted.
  Status checkCancelled() const;

  /// Calls job(worker, i) for every i below `jobs`, handed out in ascending order; `worker` is below count()
  /// and belongs to one thread at a time. Ends early with the first error.
  Status forEach(int64_t jobs, const std::function<Status(int worker, int64_t i)>& job) const;

  /// As forEach, with a second step that runs in ascending order of i, one at a time: `make` gives what
  /// `take` gets. At most a few results a worker wait for their turn.
  Status forEachInOrder(int64_t jobs,
                        const std::function<Result<std::vector<uint8_t>>(int worker, int64_t i)>& make,
                        const std::function<Status(int64_t i, std::vector<uint8_t> made)>& take) const;

 private:
  struct Limit;
  std::shared_ptr<Limit> limit_;
  int count_;
  const std::atomic<bool>* cancel_;
};

/// What work takes where nobody said how much memory it may: a quarter of the machine's.
uint64_t quarterOfMemory();

}  // namespace terrane
