#include <emscripten.h>
#include <emscripten/html5_webgl.h>

#include "driver.h"
#include "terrane/base/check.h"

/// Clip control is not in emscripten's own library.
EM_JS(void, terrane_set_clip_depth, (bool zeroToOne), {
  const control = GLctx.getExtension("EXT_clip_control");
  control.clipControlEXT(control.LOWER_LEFT_EXT,
                         zeroToOne ? control.ZERO_TO_ONE_EXT : control.NEGATIVE_ONE_TO_ONE_EXT);
});

/// Triangles by indices of 32 bits, in one call.
EM_JS(void, terrane_multi_draw_elements, (const GLsizei* counts, const void* const* offsets, GLsizei draws), {
  const multiDraw = GLctx.getExtension("WEBGL_multi_draw");
  multiDraw["multiDrawElementsWEBGL"](GLctx.TRIANGLES, HEAP32, counts >>> 2, GLctx.UNSIGNED_INT, HEAP32,
                                      offsets >>> 2, draws);
});

namespace terrane::gpu::driver {
namespace {

/// Turns it on, too, if it is there.
bool hasExtension(const char* name) {
  return emscripten_webgl_enable_extension(emscripten_webgl_get_current_context(), name) == EM_TRUE;
}

}  // namespace

bool speaks(Api api) {
  return api == Api::OpenGlEs;
}
// note: some browsers say their own name until they are asked for the driver's.
GLenum rendererNameKey() {
  constexpr GLenum kUnmaskedRenderer = 0x9246;
  return hasExtension("WEBGL_debug_renderer_info") ? kUnmaskedRenderer : GL_RENDERER;
}
bool hasFloatTargets(Api) {
  return hasExtension("EXT_color_buffer_float");
}
bool hasClipControl(Api) {
  return hasExtension("EXT_clip_control");
}
bool hasSampleShading(Api) {
  return false;
}
// note: browsers tell a query's result only once the script has given way to them, never to one who waits.
bool hasTimerQuery(Api) {
  return false;
}
bool isRemote() {
  return true;
}

void setClipDepthZeroToOne(Api, bool zeroToOne) {
  terrane_set_clip_depth(zeroToOne);
}
void setSampleShading(bool) {
  TERRANE_CHECK(false, "WebGL2 has no sample shading");
}
void bindStorage(GLuint, GLuint) {
  TERRANE_CHECK(false, "WebGL2 has no storage buffers");
}
// note: Firefox has none; a call for each range costs a microsecond or two.
bool hasMultiDraw(Api) {
  return hasExtension("WEBGL_multi_draw");
}
void multiDrawElements(Api, const GLsizei* counts, const void* const* offsets, GLsizei draws) {
  static_assert(sizeof(void*) == sizeof(int32_t));
  terrane_multi_draw_elements(counts, offsets, draws);
}
void beginTimer(GLuint) {
  TERRANE_CHECK(false, "WebGL2 has no timer that can be waited for");
}
void endTimer() {
  TERRANE_CHECK(false, "WebGL2 has no timer that can be waited for");
}
uint64_t timerNanoseconds(Api, GLuint) {
  TERRANE_CHECK(false, "WebGL2 has no timer that can be waited for");
  return 0;
}

}  // namespace terrane::gpu::driver
