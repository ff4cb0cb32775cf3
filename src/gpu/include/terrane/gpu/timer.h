#pragma once

#include <chrono>
#include <optional>

#include "terrane/gpu/context.h"
#include "terrane/gpu/name.h"

namespace terrane::gpu {

/// Measures how long the GPU works on what is drawn between begin() and end(). Where the driver has no timer
/// query it measures nothing.
class Timer {
 public:
  explicit Timer(const Context& context);

  void begin();
  void end();
  /// Seconds of the last begin() to end(); waits until the GPU is done with them. Nothing where it cannot be
  /// known.
  std::optional<double> seconds();

 private:
  bool works_ = false;
  Api api_ = Api::OpenGl;
  bool ended_ = false;
  std::chrono::steady_clock::time_point began_;
  Name<deleteQuery> query_;
};

}  // namespace terrane::gpu
