#pragma once

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

/// Threads; 0: as many as there are cores, less one for the frame, at least one.
std::unique_ptr<Workers> makeThreadWorkers(int threads = 0);
/// Does every job at once, in the caller's thread: what happens when is the same in every run.
std::unique_ptr<Workers> makeInlineWorkers();

}  // namespace terrane
