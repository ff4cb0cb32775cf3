#include "terrane/gpu/context.h"

#include <algorithm>

#include "driver.h"
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
  rendererName_ = driverString(driver::rendererNameKey());
  versionName_ = driverString(GL_VERSION);
  for (const char* name : {"llvmpipe", "softpipe", "SwiftShader"})
    if (rendererName_.find(name) != std::string::npos) isSoftware_ = true;

  if (!driver::speaks(api_))
    return makeError(
        "the driver gives {} ({}), but Terrane needs {}; update the graphics driver or install Mesa",
        versionName_, rendererName_, isGles() ? "OpenGL ES 3.0" : "OpenGL 4.5");

  // Heights are measured in float pictures: OpenGL ES 3.0 draws into them only by extension.
  if (!driver::hasFloatTargets(api_))
    return makeError("{} cannot draw into float pictures (GL_EXT_color_buffer_float)", rendererName_);

  limits_.maxTextureSize = driverInteger(GL_MAX_TEXTURE_SIZE);
  limits_.maxArrayLayers = driverInteger(GL_MAX_ARRAY_TEXTURE_LAYERS);
  limits_.maxSamples = maxSceneSamples();

  workarounds_.noClipControl = options.forbidClipControl || !driver::hasClipControl(api_);
  workarounds_.noSampleShading = !driver::hasSampleShading(api_);
  workarounds_.slowSampleShading = isSoftware_;
  workarounds_.noTimerQuery = !driver::hasTimerQuery(api_);
  workarounds_.noMultiDraw = !driver::hasMultiDraw(api_);
  workarounds_.slowErrors = driver::isRemote();

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
         "precision highp usampler2DArray;\n"
         "precision highp isampler2DArray;\n";
}

void Context::setClipDepthZeroToOne(bool zeroToOne) const {
  TERRANE_CHECK(!workarounds_.noClipControl, "{} has no clip control", rendererName_);
  driver::setClipDepthZeroToOne(api_, zeroToOne);
}

void Context::setSampleShading(bool everySample) const {
  TERRANE_CHECK(!workarounds_.noSampleShading, "{} has no sample shading", rendererName_);
  driver::setSampleShading(everySample);
}

void Context::bindStorage(GLuint bindingPoint, GLuint buffer) const {
  TERRANE_CHECK(!isGles(), "{} has no storage buffers", rendererName_);
  driver::bindStorage(bindingPoint, buffer);
}

int Context::drawRanges(std::span<const GLsizei> counts, std::span<const void* const> offsetsBytes,
                        bool oneByOne) const {
  TERRANE_CHECK(counts.size() == offsetsBytes.size(), "{} counts, {} offsets", counts.size(),
                offsetsBytes.size());
  if (counts.empty()) return 0;
  if (!workarounds_.noMultiDraw && !oneByOne) {
    driver::multiDrawElements(api_, counts.data(), offsetsBytes.data(), static_cast<GLsizei>(counts.size()));
    return 1;
  }
  for (size_t i = 0; i < counts.size(); ++i)
    glDrawElements(GL_TRIANGLES, counts[i], GL_UNSIGNED_INT, offsetsBytes[i]);
  return static_cast<int>(counts.size());
}

Status Context::checkFrame(const std::string& doing) const {
  return checkErrors(doing);
}

Status Context::checkErrors(const std::string& doing) const {
  if (workarounds_.slowErrors) return {};
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return {};
  while (glGetError() != GL_NO_ERROR) {
  }
  return makeError("OpenGL reports \"{}\" while {} on {}", errorName(error), doing, rendererName_);
}

}  // namespace terrane::gpu
