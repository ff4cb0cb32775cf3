#include "terrane/stream/workers.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "terrane/base/parallel.h"

namespace terrane {
namespace {

class ThreadWorkers final : public Workers {
 public:
  explicit ThreadWorkers(int threads) {
    for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
  }
  ~ThreadWorkers() override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  void submit(std::unique_ptr<Work> work) override {
    {
      const std::lock_guard lock(mutex_);
      waiting_.push_back(std::move(work));
    }
    wake_.notify_one();
  }
  int width() const override { return 2 * static_cast<int>(threads_.size()); }

 private:
  void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      wake_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
      if (stop_) return;
      const std::unique_ptr<Work> work = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      work->run();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_ = false;
  std::deque<std::unique_ptr<Work>> waiting_;
  std::vector<std::thread> threads_;
};

}  // namespace

std::unique_ptr<Workers> makeThreadWorkers(int threads) {
  return std::make_unique<ThreadWorkers>(threads > 0 ? threads : std::max(1, hardwareThreads() - 1));
}

}  // namespace terrane
