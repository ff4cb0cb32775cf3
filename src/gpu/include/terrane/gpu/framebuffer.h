#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/texture.h"

namespace terrane::gpu {

/// What a framebuffer holds.
struct FramebufferSpec {
  int width = 0;
  int height = 0;
  int samples = 1;  ///< 1: the colours are a texture; more: a renderbuffer, to be resolved
  TexelFormat color = kRgba8;
  bool depth = false;  ///< with a 32-bit float depth buffer
};

/// A picture to draw into, with its own storage.
class Framebuffer {
 public:
  /// Fails where the size, the samples or the memory are beyond what the driver has.
  static Result<Framebuffer> create(const Context& context, const FramebufferSpec& spec);

  const FramebufferSpec& spec() const { return spec_; }
  /// Draws go here now, over the whole picture.
  void bind() const;
  /// The colours; only with one sample.
  const Texture& color() const { return *color_; }
  /// Averages the samples of this picture into one of the same size and format with one sample.
  void resolveInto(const Framebuffer& target) const;

  /// Copies the colours (RGBA8, one sample) into the window's own picture, a page's canvas, from its lower
  /// left corner on: what is seen there when the caller gives way to the window system.
  void copyToWindow() const;

  /// The colours of an RGBA8 picture with one sample, row by row from the **top**, four bytes a pixel.
  std::vector<uint8_t> readRgba8() const;
  /// The colours of an RGBA32F picture with one sample, row by row from the **top**, four floats a pixel.
  std::vector<float> readRgba32F() const;

 private:
  Framebuffer() = default;

  FramebufferSpec spec_;
  std::unique_ptr<Texture> color_;
  Name<deleteRenderbuffer> colorSamples_;
  Name<deleteRenderbuffer> depth_;
  Name<deleteFramebuffer> name_;
};

}  // namespace terrane::gpu
