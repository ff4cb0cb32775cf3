#include "terrane/gpu/framebuffer.h"

#include <algorithm>

namespace terrane::gpu {

namespace {

Name<deleteRenderbuffer> makeRenderbuffer(GLenum format, const FramebufferSpec& spec) {
  GLuint name = 0;
  glGenRenderbuffers(1, &name);
  glBindRenderbuffer(GL_RENDERBUFFER, name);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, spec.samples > 1 ? spec.samples : 0, format, spec.width,
                                   spec.height);
  return Name<deleteRenderbuffer>(name);
}

/// OpenGL's first row is the bottom one, everybody else's the top one.
template <class T>
void flipRows(std::vector<T>& texels, int width, int height) {
  const auto row = static_cast<std::ptrdiff_t>(width) * 4;
  for (int y = 0; y < height / 2; ++y)
    std::swap_ranges(texels.begin() + y * row, texels.begin() + (y + 1) * row,
                     texels.begin() + (height - 1 - y) * row);
}

}  // namespace

Result<Framebuffer> Framebuffer::create(const Context& context, const FramebufferSpec& spec) {
  const int largest = context.limits().maxTextureSize;
  if (spec.width < 1 || spec.height < 1 || spec.width > largest || spec.height > largest)
    return makeError("a picture of {} x {} pixels cannot be drawn on {}: sides are 1 to {}", spec.width,
                     spec.height, context.rendererName(), largest);
  TERRANE_TRY(context.checkErrors("drawing, before a picture was made"));
  Framebuffer out;
  out.spec_ = spec;
  GLuint name = 0;
  glGenFramebuffers(1, &name);
  out.name_ = Name<deleteFramebuffer>(name);
  glBindFramebuffer(GL_FRAMEBUFFER, name);
  if (spec.samples > 1) {
    out.colorSamples_ = makeRenderbuffer(spec.color.internalFormat, spec);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, out.colorSamples_.get());
  } else {
    out.color_ = std::make_unique<Texture>(spec.color, spec.width, spec.height);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, out.color_->name(), 0);
  }
  if (spec.depth) {
    out.depth_ = makeRenderbuffer(GL_DEPTH_COMPONENT32F, spec);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, out.depth_.get());
  }
  TERRANE_TRY(context.checkErrors("making a picture to draw into"));
  // note: that would wait as well. What is drawn into here are formats that were asked for at the beginning.
  if (context.workarounds().slowErrors) return out;
  const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
  if (status != GL_FRAMEBUFFER_COMPLETE)
    return makeError("{} cannot draw into a picture of format {:#x} with {} samples (status {:#x})",
                     context.rendererName(), spec.color.internalFormat, spec.samples, status);
  return out;
}

void Framebuffer::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, name_.get());
  glViewport(0, 0, spec_.width, spec_.height);
}

void Framebuffer::resolveInto(const Framebuffer& target) const {
  TERRANE_CHECK(target.spec_.width == spec_.width && target.spec_.height == spec_.height,
                "{} x {} into {} x {}", spec_.width, spec_.height, target.spec_.width, target.spec_.height);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, name_.get());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.name_.get());
  glBlitFramebuffer(0, 0, spec_.width, spec_.height, 0, 0, spec_.width, spec_.height, GL_COLOR_BUFFER_BIT,
                    GL_NEAREST);
}

void Framebuffer::copyToWindow() const {
  TERRANE_CHECK(spec_.color.internalFormat == GL_RGBA8 && spec_.samples == 1, "not a picture of RGBA8");
  glBindFramebuffer(GL_READ_FRAMEBUFFER, name_.get());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  glBlitFramebuffer(0, 0, spec_.width, spec_.height, 0, 0, spec_.width, spec_.height, GL_COLOR_BUFFER_BIT,
                    GL_NEAREST);
}

std::vector<uint8_t> Framebuffer::readRgba8() const {
  TERRANE_CHECK(spec_.color.internalFormat == GL_RGBA8 && spec_.samples == 1, "not a picture of RGBA8");
  std::vector<uint8_t> out(static_cast<size_t>(spec_.width) * static_cast<size_t>(spec_.height) * 4);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, name_.get());
  glReadPixels(0, 0, spec_.width, spec_.height, GL_RGBA, GL_UNSIGNED_BYTE, out.data());
  flipRows(out, spec_.width, spec_.height);
  return out;
}

std::vector<float> Framebuffer::readRgba32F() const {
  TERRANE_CHECK(spec_.color.internalFormat == GL_RGBA32F && spec_.samples == 1, "not a picture of RGBA32F");
  std::vector<float> out(static_cast<size_t>(spec_.width) * static_cast<size_t>(spec_.height) * 4);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, name_.get());
  glReadPixels(0, 0, spec_.width, spec_.height, GL_RGBA, GL_FLOAT, out.data());
  flipRows(out, spec_.width, spec_.height);
  return out;
}

}  // namespace terrane::gpu
