#include "terrane/gpu/timer.h"

#include "driver.h"

namespace terrane::gpu {

Timer::Timer(const Context& context) : works_(!context.workarounds().noTimerQuery), api_(context.api()) {
  if (!works_) return;
  GLuint name = 0;
  glGenQueries(1, &name);
  query_ = Name<deleteQuery>(name);
}

void Timer::begin() {
  began_ = std::chrono::steady_clock::now();
  if (works_) driver::beginTimer(query_.get());
}

void Timer::end() {
  if (!works_) return;
  driver::endTimer();
  ended_ = true;
}

std::optional<double> Timer::seconds() {
  if (!works_ || !ended_) return std::nullopt;
  // note: llvmpipe's first answer counts from the machine's start; no work takes longer than it has existed.
  const double seconds = static_cast<double>(driver::timerNanoseconds(api_, query_.get())) * 1e-9;
  const std::chrono::duration<double> sinceBegin = std::chrono::steady_clock::now() - began_;
  if (seconds > sinceBegin.count()) return std::nullopt;
  return seconds;
}

}  // namespace terrane::gpu
