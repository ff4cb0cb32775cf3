#pragma once

#include <deque>
#include <memory>

#include "terrane/stream/work.h"

namespace terrane {

/// Who does work that a frame must not wait for.
class Workers {
 public:
  virtual ~Workers() = default;
  /// Does `work` some time, in any thread. What is not begun is dropped at the end.
  virtual void submit(std::unique_ptr<Work> work) = 0;
  /// Pieces of work that are useful to have waiting or running at once.
  virtual int width() const = 0;

  /// Does an order, and then `take(answer)`, in the thread that did it or in the one that all this belongs
  /// to.
  template <class Order, class Take>
  void order(Order order, Take take) {
    submit(std::make_unique<OrderedWork<Order, Take>>(std::move(order), std::move(take)));
  }
};

/// Outside browsers: threads; 0: as many as there are cores, less one for the frame, at least one.
std::unique_ptr<Workers> makeThreadWorkers(int threads = 0);
/// Does all work at once, in the caller's thread: what happens when is the same in every run.
std::unique_ptr<Workers> makeInlineWorkers();

/// Works between frames, in the caller's thread: for pages that have no workers (decision 64).
class SlicedWorkers final : public Workers {
 public:
  void submit(std::unique_ptr<Work> work) override;
  /// Few, so that what becomes urgent does not stand behind what was.
  int width() const override { return 4; }

  /// Works in the order in which it came until `seconds` have passed or nothing is left, at least one piece
  /// if there is one; the last may take longer. Returns how many.
  int work(double seconds);
  bool isIdle() const { return waiting_.empty(); }
  /// For those who can have it done elsewhere: the first that waits, null if there is none; and back again.
  std::unique_ptr<Work> takeFirst();
  void putFirst(std::unique_ptr<Work> work) { waiting_.push_front(std::move(work)); }

 private:
  std::deque<std::unique_ptr<Work>> waiting_;
};

}  // namespace terrane
