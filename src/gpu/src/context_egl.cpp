// Contexts without a window through EGL: everything that depends on the platform stands in this file.
#include <epoxy/egl.h>

#include <array>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include "terrane/gpu/context.h"
#include "terrane/gpu/gl.h"

namespace terrane::gpu {

namespace {

class EglContext final : public Context {
 public:
  EglContext(EGLDisplay display, EGLContext context) : display_(display), context_(context) {}
  ~EglContext() override {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    // note: the display stays initialised; it is shared by every context of the process on that device.
    eglDestroyContext(display_, context_);
  }
  void makeCurrent() override { eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_); }
  Status read(const ContextOptions& options) { return readCapabilities(options); }

 private:
  EGLDisplay display_;
  EGLContext context_;
};

/// Is `name` one of the words in the space-separated `list`?
bool contains(const char* list, std::string_view name) {
  if (list == nullptr) return false;
  const std::string_view all(list);
  for (size_t at = all.find(name); at != std::string_view::npos; at = all.find(name, at + 1)) {
    const size_t end = at + name.size();
    if ((at == 0 || all[at - 1] == ' ') && (end == all.size() || all[end] == ' ')) return true;
  }
  return false;
}

/// A display to try, and what to call it in a message.
struct Candidate {
  EGLDisplay display = EGL_NO_DISPLAY;
  std::string name;
};

/// The displays of the GPUs, the best first.
void addDeviceDisplays(const char* clientExtensions, std::vector<Candidate>& out) {
  if (!contains(clientExtensions, "EGL_EXT_platform_device") ||
      !(contains(clientExtensions, "EGL_EXT_device_enumeration") ||
        contains(clientExtensions, "EGL_EXT_device_base")))
    return;
  std::array<EGLDeviceEXT, 16> devices{};
  EGLint count = 0;
  if (!eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count)) return;
  for (EGLint i = 0; i < count; ++i) {
    EGLDeviceEXT device = devices[static_cast<size_t>(i)];
    // Mesa lists its own rasteriser as a device too; it is tried last, without a device.
    const char* deviceExtensions = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
    if (contains(deviceExtensions, "EGL_MESA_device_software")) continue;
    EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr);
    if (display != EGL_NO_DISPLAY) out.push_back({display, "GPU " + std::to_string(i)});
  }
}

void addSurfacelessDisplay(const char* clientExtensions, std::vector<Candidate>& out) {
  if (!contains(clientExtensions, "EGL_MESA_platform_surfaceless")) return;
  EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (display != EGL_NO_DISPLAY) out.push_back({display, "Mesa without a surface"});
}

/// The software rasteriser as a device, for installations that lack the surfaceless platform.
void addSoftwareDevice(const char* clientExtensions, std::vector<Candidate>& out) {
  if (!contains(clientExtensions, "EGL_EXT_platform_device")) return;
  std::array<EGLDeviceEXT, 16> devices{};
  EGLint count = 0;
  if (!eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count)) return;
  for (EGLint i = 0; i < count; ++i) {
    EGLDeviceEXT device = devices[static_cast<size_t>(i)];
    if (!contains(eglQueryDeviceStringEXT(device, EGL_EXTENSIONS), "EGL_MESA_device_software")) continue;
    EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr);
    if (display != EGL_NO_DISPLAY) out.push_back({display, "Mesa's software device"});
  }
}

/// Any config that the API can draw with: for drivers that cannot make a context without one.
EGLConfig anyConfig(EGLDisplay display, Api api) {
  const std::array<EGLint, 3> wanted = {EGL_RENDERABLE_TYPE,
                                        api == Api::OpenGlEs ? EGL_OPENGL_ES3_BIT : EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (!eglChooseConfig(display, wanted.data(), &config, 1, &count) || count < 1) return EGL_NO_CONFIG_KHR;
  return config;
}

Result<std::unique_ptr<EglContext>> createOn(const Candidate& candidate, const ContextOptions& options) {
  EGLDisplay display = candidate.display;
  if (!eglInitialize(display, nullptr, nullptr))
    return makeError("{} cannot be initialised (EGL error {:#x})", candidate.name, eglGetError());
  const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
  if (!contains(extensions, "EGL_KHR_surfaceless_context"))
    return makeError("{} cannot draw without a window", candidate.name);

  const bool gles = options.api == Api::OpenGlEs;
  if (!eglBindAPI(gles ? EGL_OPENGL_ES_API : EGL_OPENGL_API))
    return makeError("{} has no {}", candidate.name, gles ? "OpenGL ES" : "OpenGL");
  const std::array<EGLint, 7> core = {EGL_CONTEXT_MAJOR_VERSION,
                                      4,
                                      EGL_CONTEXT_MINOR_VERSION,
                                      5,
                                      EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                      EGL_NONE};
  const std::array<EGLint, 5> embedded = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 0,
                                          EGL_NONE};
  const bool configless = contains(extensions, "EGL_KHR_no_config_context") ||
                          contains(extensions, "EGL_MESA_configless_context");
  EGLConfig config = configless ? EGL_NO_CONFIG_KHR : anyConfig(display, options.api);
  EGLContext context =
      eglCreateContext(display, config, EGL_NO_CONTEXT, gles ? embedded.data() : core.data());
  if (context == EGL_NO_CONTEXT)
    return makeError("{} has no {} context (EGL error {:#x})", candidate.name,
                     gles ? "OpenGL ES 3.0" : "OpenGL 4.5 core", eglGetError());
  if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
    const EGLint error = eglGetError();
    eglDestroyContext(display, context);
    return makeError("{} cannot make its context current (EGL error {:#x})", candidate.name, error);
  }
  auto out = std::make_unique<EglContext>(display, context);
  TERRANE_TRY(out->read(options));
  return out;
}

}  // namespace

Result<std::unique_ptr<Context>> Context::createHeadless(const ContextOptions& options) {
  const char* clientExtensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (clientExtensions == nullptr)
    return makeError(
        "EGL has no client extensions, so nothing can be drawn without a window; install Mesa "
        "(Debian: libegl1 libgl1-mesa-dri)");
  std::vector<Candidate> candidates;
  if (!options.forceSoftware) addDeviceDisplays(clientExtensions, candidates);
  if (options.forceSoftware) addSoftwareDevice(clientExtensions, candidates);
  addSurfacelessDisplay(clientExtensions, candidates);
  if (!options.forceSoftware) addSoftwareDevice(clientExtensions, candidates);

  // The first one that works is taken; what went wrong with the others is told only if none does.
  std::string reasons;
  for (const Candidate& candidate : candidates) {
    auto context = createOn(candidate, options);
    if (!context.ok()) {
      reasons += "; " + context.error().message;
      continue;
    }
    if (options.forceSoftware && !(*context)->isSoftware()) {
      reasons += "; " + candidate.name + " is not a software rasteriser";
      continue;
    }
    return std::unique_ptr<Context>(std::move(context).value());
  }
  return makeError("no OpenGL without a window{}; install Mesa (Debian: libegl1 libgl1-mesa-dri)", reasons);
}

}  // namespace terrane::gpu
