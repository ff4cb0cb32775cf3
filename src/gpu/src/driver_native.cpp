#include "driver.h"

namespace terrane::gpu::driver {

GLenum rendererNameKey() {
  return GL_RENDERER;
}
bool speaks(Api api) {
  const bool isGles = api == Api::OpenGlEs;
  return epoxy_is_desktop_gl() != isGles && epoxy_gl_version() >= (isGles ? 30 : 45);
}

bool hasFloatTargets(Api api) {
  return api == Api::OpenGl || epoxy_gl_version() >= 32 ||
         epoxy_has_gl_extension("GL_EXT_color_buffer_float");
}
bool hasClipControl(Api api) {
  return api == Api::OpenGl || epoxy_has_gl_extension("GL_EXT_clip_control");
}
bool hasSampleShading(Api api) {
  return api == Api::OpenGl || epoxy_gl_version() >= 32;
}
bool hasTimerQuery(Api api) {
  return api == Api::OpenGl || epoxy_has_gl_extension("GL_EXT_disjoint_timer_query");
}
bool isRemote() {
  return false;
}

void setClipDepthZeroToOne(Api api, bool zeroToOne) {
  const GLenum depth = zeroToOne ? GL_ZERO_TO_ONE : GL_NEGATIVE_ONE_TO_ONE;
  if (api == Api::OpenGlEs)
    glClipControlEXT(GL_LOWER_LEFT, depth);
  else
    glClipControl(GL_LOWER_LEFT, depth);
}

void setSampleShading(bool everySample) {
  if (everySample) {
    glEnable(GL_SAMPLE_SHADING);
    glMinSampleShading(1.0F);
  } else {
    glDisable(GL_SAMPLE_SHADING);
  }
}

void bindStorage(GLuint bindingPoint, GLuint buffer) {
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, bindingPoint, buffer);
}
bool hasMultiDraw(Api api) {
  return api == Api::OpenGl || epoxy_has_gl_extension("GL_EXT_multi_draw_arrays");
}
void multiDrawElements(Api api, const GLsizei* counts, const void* const* offsets, GLsizei draws) {
  if (api == Api::OpenGlEs)
    glMultiDrawElementsEXT(GL_TRIANGLES, counts, GL_UNSIGNED_INT, offsets, draws);
  else
    glMultiDrawElements(GL_TRIANGLES, counts, GL_UNSIGNED_INT, offsets, draws);
}

void beginTimer(GLuint query) {
  glBeginQuery(GL_TIME_ELAPSED, query);
}
void endTimer() {
  glEndQuery(GL_TIME_ELAPSED);
}
uint64_t timerNanoseconds(Api api, GLuint query) {
  GLuint64 nanoseconds = 0;
  if (api == Api::OpenGlEs)
    glGetQueryObjectui64vEXT(query, GL_QUERY_RESULT_EXT, &nanoseconds);
  else
    glGetQueryObjectui64v(query, GL_QUERY_RESULT, &nanoseconds);
  return nanoseconds;
}

}  // namespace terrane::gpu::driver
