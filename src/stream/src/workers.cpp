#include "terrane/stream/workers.h"

#include <chrono>
#include <utility>

namespace terrane {
namespace {

class InlineWorkers final : public Workers {
 public:
  void submit(std::unique_ptr<Work> work) override { work->run(); }
  int width() const override { return 64; }
};

}  // namespace

std::unique_ptr<Workers> makeInlineWorkers() {
  return std::make_unique<InlineWorkers>();
}

void SlicedWorkers::submit(std::unique_ptr<Work> work) {
  waiting_.push_back(std::move(work));
}

std::unique_ptr<Work> SlicedWorkers::takeFirst() {
  if (waiting_.empty()) return nullptr;
  std::unique_ptr<Work> first = std::move(waiting_.front());
  waiting_.pop_front();
  return first;
}

int SlicedWorkers::work(double seconds) {
  const auto begun = std::chrono::steady_clock::now();
  int done = 0;
  // note: taking an answer may submit more.
  while (const std::unique_ptr<Work> work = takeFirst()) {
    work->run();
    ++done;
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begun;
    if (spent.count() >= seconds) break;
  }
  return done;
}

}  // namespace terrane
