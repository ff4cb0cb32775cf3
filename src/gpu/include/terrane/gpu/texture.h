#pragma once

#include <cstddef>

#include "terrane/base/result.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/name.h"

namespace terrane::gpu {

/// How a texture's texels are stored, and the format and type in which they are uploaded.
struct TexelFormat {
  GLenum internalFormat;
  GLenum format;
  GLenum type;
  int bytes;  ///< a texel, as uploaded

  bool isInteger() const { return format == GL_RED_INTEGER || format == GL_RGBA_INTEGER; }
};
inline constexpr TexelFormat kR32F{GL_R32F, GL_RED, GL_FLOAT, 4};
inline constexpr TexelFormat kRg16F{GL_RG16F, GL_RG, GL_HALF_FLOAT, 4};
inline constexpr TexelFormat kR8Ui{GL_R8UI, GL_RED_INTEGER, GL_UNSIGNED_BYTE, 1};
inline constexpr TexelFormat kRgba8{GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, 4};
inline constexpr TexelFormat kRgba16F{GL_RGBA16F, GL_RGBA, GL_HALF_FLOAT, 8};
inline constexpr TexelFormat kRgba32I{GL_RGBA32I, GL_RGBA_INTEGER, GL_INT, 16};
inline constexpr TexelFormat kRgba32F{GL_RGBA32F, GL_RGBA, GL_FLOAT, 16};

enum class Filter { Nearest, Linear };

/// One picture on the GPU without mipmaps, clamped at its edges.
class Texture {
 public:
  Texture(TexelFormat format, int width, int height, Filter filter = Filter::Nearest);

  GLuint name() const { return name_.get(); }
  int width() const { return width_; }
  int height() const { return height_; }
  const TexelFormat& format() const { return format_; }
  void bindToUnit(int unit) const;

 private:
  TexelFormat format_;
  int width_;
  int height_;
  Name<deleteTexture> name_;
};

/// A rectangle of a layer, in texels.
struct TexelRect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// How a texture array grows: ahead of what is asked for, so that it seldom does, or to just that.
enum class Growth : uint8_t { Ahead, Exact };

/// Pictures of one size and format, addressed by layer, without mipmaps. It grows in steps; growing keeps
/// what is there (a copy on the GPU).
class TextureArray {
 public:
  TextureArray(TexelFormat format, int width, int height, Filter filter);

  GLuint name() const { return name_.get(); }
  int width() const { return width_; }
  int height() const { return height_; }
  int layers() const { return layers_; }
  size_t sizeBytes() const { return layerBytes() * static_cast<size_t>(layers_); }
  size_t layerBytes() const;

  /// Makes room for at least `layers` layers. Fails where the driver's memory or its limit is exceeded, and
  /// leaves the array as it was.
  Status reserve(const Context& context, int layers, Growth growth = Growth::Ahead);
  /// Replaces a rectangle of a layer; `texels` are row by row in the array's format.
  void upload(int layer, const TexelRect& rect, const void* texels);
  void uploadLayer(int layer, const void* texels) { upload(layer, {0, 0, width_, height_}, texels); }
  void bindToUnit(int unit) const;

 private:
  GLuint allocate(int layers) const;

  TexelFormat format_;
  int width_;
  int height_;
  Filter filter_;
  int layers_ = 0;
  Name<deleteTexture> name_;
};

}  // namespace terrane::gpu
