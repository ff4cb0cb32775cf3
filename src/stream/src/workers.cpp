#include "terrane/stream/workers.h"

#include <chrono>
#include <utility>

namespace terrane {
namespace {

class InlineWorkers final : public Workers {
 public:
  void submit(std::function<void()> job) override { job(); }
  int width() const override { return 64; }
};

}  // namespace

std::unique_ptr<Workers> makeInlineWorkers() {
  return std::make_unique<InlineWorkers>();
}

void SlicedWorkers::submit(std::function<void()> job) {
  jobs_.push_back(std::move(job));
}

int SlicedWorkers::work(double seconds) {
  const auto begun = std::chrono::steady_clock::now();
  int done = 0;
  // note: a job may submit others.
  while (!jobs_.empty()) {
    const std::function<void()> job = std::move(jobs_.front());
    jobs_.pop_front();
    job();
    ++done;
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begun;
    if (spent.count() >= seconds) break;
  }
  return done;
}

}  // namespace terrane
