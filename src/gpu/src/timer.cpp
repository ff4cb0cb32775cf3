#include "terrane/gpu/timer.h"

namespace terrane::gpu {

Timer::Timer(const Context& context)
    : works_(!context.workarounds().noTimerQuery), isGles_(context.isGles()) {
  if (!works_) return;
  GLuint name = 0;
  glGenQueries(1, &name);
  query_ = Name<deleteQuery>(name);
}

void Timer::begin() {
  began_ = std::chrono::steady_clock::now();
  if (works_) glBeginQuery(GL_TIME_ELAPSED, query_.get());
}

void Timer::end() {
  if (!works_) return;
  glEndQuery(GL_TIME_ELAPSED);
  ended_ = true;
}

std::optional<double> Timer::seconds() {
  if (!works_ || !ended_) return std::nullopt;
  GLuint64 nanoseconds = 0;
  if (isGles_)
    glGetQueryObjectui64vEXT(query_.get(), GL_QUERY_RESULT_EXT, &nanoseconds);
  else
    glGetQueryObjectui64v(query_.get(), GL_QUERY_RESULT, &nanoseconds);
  // note: llvmpipe's first answer counts from the machine's start; no work takes longer than it has existed.
  const double seconds = static_cast<double>(nanoseconds) * 1e-9;
  const std::chrono::duration<double> sinceBegin = std::chrono::steady_clock::now() - began_;
  if (seconds > sinceBegin.count()) return std::nullopt;
  return seconds;
}

}  // namespace terrane::gpu
