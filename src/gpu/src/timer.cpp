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
  return static_cast<double>(nanoseconds) * 1e-9;
}

}  // namespace terrane::gpu
