#pragma once

#include <deque>
#include <functional>
#include <memory>

namespace terrane {

/// Who does work that a frame must not wait for.
class Workers {
 public:
  virtual ~Workers() = default;
  /// Does `job` some time, in any thread; jobs must not throw. Those not begun are dropped at the end.
  virtual void submit(std::function<void()> job) = 0;
  /// Jobs that are useful to have waiting or running at once.
  virtual int width() const = 0;
};

/// Outside browsers: threads; 0: as many as there are cores, less one for the frame, at least one.
std::unique_ptr<Workers> makeThreadWorkers(int threads = 0);
/// Does every job at once, in the caller's thread: what happens when is the same in every run.
std::unique_ptr<Workers> makeInlineWorkers();

/// Does jobs between frames, in the caller's thread: for pages that may not have threads (decision 64).
class SlicedWorkers final : public Workers {
 public:
  void submit(std::function<void()> job) override;
  /// Few, so that what becomes urgent does not stand behind what was.
  int width() const override { return 4; }

  /// Does jobs in the order in which they came until `seconds` have passed or none is left, at least one if
  /// there is one; the last may take longer. Returns how many.
  int work(double seconds);
  bool isIdle() const { return jobs_.empty(); }

 private:
  std::deque<std::function<void()>> jobs_;
};

}  // namespace terrane
