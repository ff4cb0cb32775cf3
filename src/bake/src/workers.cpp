#include "workers.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <mutex>
#include <optional>

namespace terrane {

namespace {

/// The first of several errors, from any thread.
class FirstError {
 public:
  void set(Error error) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = std::move(error);
    failed_.store(true);
  }
  bool failed() const { return failed_.load(std::memory_order_relaxed); }
  Status status() const { return error_ ? Status(*error_) : Status(); }

 private:
  std::mutex mutex_;
  std::atomic<bool> failed_{false};
  std::optional<Error> error_;
};

/// Which worker numbers are free.
class WorkerNumbers {
 public:
  explicit WorkerNumbers(int count) {
    for (int i = count; i-- > 0;) free_.push_back(i);
  }
  int take() {
    const std::lock_guard lock(mutex_);
    const int worker = free_.back();
    free_.pop_back();
    return worker;
  }
  void giveBack(int worker) {
    const std::lock_guard lock(mutex_);
    free_.push_back(worker);
  }

 private:
  std::mutex mutex_;
  std::vector<int> free_;
};

}  // namespace

/// Lets TBB have as many threads as were asked for, be it more than there are cores.
struct Workers::Limit {
  explicit Limit(int threads)
      : control(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads)) {}
  tbb::global_control control;
};

Workers::Workers(int threads, const std::atomic<bool>* cancel)
    : count_(threads > 0 ? threads : tbb::info::default_concurrency()), cancel_(cancel) {
  limit_ = std::make_shared<Limit>(count_);
}

Status Workers::checkCancelled() const {
  if (cancel_ != nullptr && cancel_->load(std::memory_order_relaxed)) return makeError("interrupted");
  return {};
}

Status Workers::forEach(int64_t jobs, const std::function<Status(int, int64_t)>& job) const {
  FirstError error;
  std::atomic<int64_t> next{0};
  const auto work = [&](int worker) {
    for (int64_t i = next.fetch_add(1); i < jobs && !error.failed(); i = next.fetch_add(1)) {
      Status status = checkCancelled();
      if (status.ok()) status = job(worker, i);
      if (!status.ok()) error.set(status.error());
    }
  };
  if (count_ == 1) {
    work(0);
    return error.status();
  }
  tbb::task_arena arena(count_);
  arena.execute([&] { tbb::parallel_for(0, count_, work, tbb::simple_partitioner()); });
  return error.status();
}

Status Workers::forEachInOrder(int64_t jobs,
                               const std::function<Result<std::vector<uint8_t>>(int, int64_t)>& make,
                               const std::function<Status(int64_t, std::vector<uint8_t>)>& take) const {
  struct Made {
    int64_t i = 0;
    std::vector<uint8_t> bytes;
  };
  FirstError error;
  WorkerNumbers workers(count_);
  int64_t next = 0;
  const auto begin = [&](tbb::flow_control& control) -> int64_t {
    const Status status = checkCancelled();
    if (!status.ok()) error.set(status.error());
    if (next >= jobs || error.failed()) {
      control.stop();
      return -1;
    }
    return next++;
  };
  const auto middle = [&](int64_t i) -> Made {
    if (error.failed()) return {i, {}};
    const int worker = workers.take();
    auto made = make(worker, i);
    workers.giveBack(worker);
    if (made.ok()) return {i, std::move(made).value()};
    error.set(made.error());
    return {i, {}};
  };
  const auto end = [&](Made made) {
    if (error.failed()) return;
    const Status status = take(made.i, std::move(made.bytes));
    if (!status.ok()) error.set(status.error());
  };
  tbb::task_arena arena(count_);
  arena.execute([&] {
    tbb::parallel_pipeline(static_cast<size_t>(4 * count_),
                           tbb::make_filter<void, int64_t>(tbb::filter_mode::serial_in_order, begin) &
                               tbb::make_filter<int64_t, Made>(tbb::filter_mode::parallel, middle) &
                               tbb::make_filter<Made, void>(tbb::filter_mode::serial_in_order, end));
  });
  return error.status();
}

uint64_t quarterOfMemory() {
  const auto pages = static_cast<uint64_t>(std::max(1L, sysconf(_SC_PHYS_PAGES)));
  return pages * static_cast<uint64_t>(std::max(1L, sysconf(_SC_PAGE_SIZE))) / 4;
}

}  // namespace terrane
