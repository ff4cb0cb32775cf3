// Contexts of a canvas: everything that depends on browsers stands in this file and in driver_web.cpp.
#include <emscripten/html5_webgl.h>

#include "terrane/gpu/context.h"

namespace terrane::gpu {
namespace {

class CanvasContext final : public Context {
 public:
  explicit CanvasContext(EMSCRIPTEN_WEBGL_CONTEXT_HANDLE handle) : handle_(handle) {}
  ~CanvasContext() override { emscripten_webgl_destroy_context(handle_); }
  void makeCurrent() override { emscripten_webgl_make_context_current(handle_); }
  Status read(const ContextOptions& options) { return readCapabilities(options); }

 private:
  EMSCRIPTEN_WEBGL_CONTEXT_HANDLE handle_;
};

}  // namespace

Result<std::unique_ptr<Context>> Context::createOnCanvas(const std::string& selector,
                                                         const ContextOptions& options) {
  EmscriptenWebGLContextAttributes attributes;
  emscripten_webgl_init_context_attributes(&attributes);
  attributes.majorVersion = 2;
  attributes.minorVersion = 0;
  // Pictures are drawn elsewhere, with the samples that they want, and copied into the canvas.
  attributes.alpha = false;
  attributes.depth = false;
  attributes.stencil = false;
  attributes.antialias = false;
  attributes.powerPreference = EM_WEBGL_POWER_PREFERENCE_HIGH_PERFORMANCE;
  attributes.enableExtensionsByDefault = true;
  const EMSCRIPTEN_WEBGL_CONTEXT_HANDLE handle =
      emscripten_webgl_create_context(selector.c_str(), &attributes);
  if (handle <= 0)
    return makeError(
        "canvas \"{}\": this browser gives no WebGL2 (code {}); update it, or turn hardware acceleration on",
        selector, handle);
  emscripten_webgl_make_context_current(handle);
  auto out = std::make_unique<CanvasContext>(handle);
  ContextOptions asked = options;
  asked.api = Api::OpenGlEs;
  TERRANE_TRY(out->read(asked));
  return std::unique_ptr<Context>(std::move(out));
}

}  // namespace terrane::gpu
