#include "terrane/gpu/context.h"

#include <algorithm>

#include "terrane/gpu/gl.h"

namespace terrane::gpu {

namespace {

std::string driverString(GLenum name) {
  const auto* text = reinterpret_cast<const char*>(glGetString(name));
  return text != nullptr ? text : "unknown";
}

int driverInteger(GLenum name) {
  GLint value = 0;
  glGetIntegerv(name, &value);
  return value;
}

const char* errorName(GLenum error) {
  switch (error) {
    case GL_INVALID_ENUM:
      return "invalid enum";
    case GL_INVALID_VALUE:
      return "invalid value";
    case GL_INVALID_OPERATION:
      return "invalid operation";
    case GL_INVALID_FRAMEBUFFER_OPERATION:
      return "invalid framebuffer operation";
    case GL_OUT_OF_MEMORY:
      return "out of memory";
    default:
      return "unknown error";
  }
}

/// Samples that both the colours and the depth of a scene can have.
int maxSceneSamples() {
  GLint color = 1;
  GLint depth = 1;
  glGetInternalformativ(GL_RENDERBUFFER, GL_RGBA16F, GL_SAMPLES, 1, &color);
  glGetInternalformativ(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, GL_SAMPLES, 1, &depth);
  return std::max(1, std::min(color, depth));
}

}  // namespace

Status Context::readCapabilities(const ContextOptions& options) {
  api_ = options.api;
  rendererName_ = driverString(GL_RENDERER);
  versionName_ = driverString(GL_VERSION);
  for (const char* name : {"llvmpipe", "softpipe", "SwiftShader"})
    if (rendererName_.find(name) != std::string::npos) isSoftware_ = true;

  const int version = epoxy_gl_version();
  if (epoxy_is_desktop_gl() == isGles() || version < (isGles() ? 30 : 45))
    return makeError(
        "the driver gives {} ({}), but Terrane needs {}; update the graphics driver or install Mesa",
        versionName_, rendererName_, isGles() ? "OpenGL ES 3.0" : "OpenGL 4.5");

  // Heights are measured in float pictures: OpenGL ES 3.0 draws into them only by extension.
  if (isGles() && version < 32 && !epoxy_has_gl_extension("GL_EXT_color_buffer_float"))
    return makeError("{} cannot draw into float pictures (GL_EXT_color_buffer_float)", rendererName_);

  limits_.maxTextureSize = driverInteger(GL_MAX_TEXTURE_SIZE);
  limits_.maxArrayLayers = driverInteger(GL_MAX_ARRAY_TEXTURE_LAYERS);
  limits_.maxSamples = maxSceneSamples();

  workarounds_.noClipControl =
      options.forbidClipControl || (isGles() && !epoxy_has_gl_extension("GL_EXT_clip_control"));
  workarounds_.noSampleShading = isGles() && version < 32;
  workarounds_.slowSampleShading = isSoftware_;
  workarounds_.noTimerQuery = isGles() && !epoxy_has_gl_extension("GL_EXT_disjoint_timer_query");

  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  return checkErrors("asking for the driver's limits");
}

std::string Context::shaderPrologue() const {
  if (!isGles()) return "#version 450 core\n";
  return "#version 300 es\n"
         "precision highp float;\n"
         "precision highp int;\n"
         "precision highp sampler2D;\n"
         "precision highp sampler2DArray;\n"
         "precision highp usampler2DArray;\n";
}

void Context::setClipDepthZeroToOne(bool zeroToOne) const {
  TERRANE_CHECK(!workarounds_.noClipControl, "{} has no clip control", rendererName_);
  const GLenum depth = zeroToOne ? GL_ZERO_TO_ONE : GL_NEGATIVE_ONE_TO_ONE;
  if (isGles())
    glClipControlEXT(GL_LOWER_LEFT, depth);
  else
    glClipControl(GL_LOWER_LEFT, depth);
}

Status Context::checkErrors(const std::string& doing) const {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return {};
  while (glGetError() != GL_NO_ERROR) {
  }
  return makeError("OpenGL reports \"{}\" while {} on {}", errorName(error), doing, rendererName_);
}

}  // namespace terrane::gpu
