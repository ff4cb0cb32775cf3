#include "terrane/gpu/texture.h"

#include <algorithm>

namespace terrane::gpu {

namespace {

GLuint makeName(GLenum target, Filter filter) {
  GLuint name = 0;
  glGenTextures(1, &name);
  glBindTexture(target, name);
  const GLint mode = filter == Filter::Linear ? GL_LINEAR : GL_NEAREST;
  glTexParameteri(target, GL_TEXTURE_MIN_FILTER, mode);
  glTexParameteri(target, GL_TEXTURE_MAG_FILTER, mode);
  glTexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return name;
}

void bindUnit(GLenum target, int unit, GLuint name) {
  glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + unit));
  glBindTexture(target, name);
}

}  // namespace

Texture::Texture(TexelFormat format, int width, int height, Filter filter)
    : format_(format), width_(width), height_(height), name_(makeName(GL_TEXTURE_2D, filter)) {
  glTexStorage2D(GL_TEXTURE_2D, 1, format_.internalFormat, width_, height_);
}

void Texture::bindToUnit(int unit) const {
  bindUnit(GL_TEXTURE_2D, unit, name_.get());
}

TextureArray::TextureArray(TexelFormat format, int width, int height, Filter filter)
    : format_(format), width_(width), height_(height), filter_(filter) {}

size_t TextureArray::layerBytes() const {
  return static_cast<size_t>(width_) * static_cast<size_t>(height_) * static_cast<size_t>(format_.bytes);
}

GLuint TextureArray::allocate(int layers) const {
  const GLuint name = makeName(GL_TEXTURE_2D_ARRAY, filter_);
  glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, format_.internalFormat, width_, height_, layers);
  return name;
}

Status TextureArray::reserve(const Context& context, int layers, Growth growth) {
  constexpr int kSmallest = 16;
  if (layers <= layers_) return {};
  const int most = context.limits().maxArrayLayers;
  if (layers > most)
    return makeError("{} layers of a texture array, but the driver's limit is {}", layers, most);
  const int wanted =
      growth == Growth::Exact ? layers : std::min(most, std::max({layers, kSmallest, layers_ + layers_ / 2}));
  TERRANE_TRY(context.checkErrors("drawing, before a texture array grew"));
  Name<deleteTexture> grown(allocate(wanted));
  TERRANE_TRY(context.checkErrors("making a texture array larger"));

  // Layers are copied through a framebuffer: the one way that WebGL2 has too.
  if (layers_ > 0) {
    GLint previous = 0;
    glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &previous);
    GLuint reader = 0;
    glGenFramebuffers(1, &reader);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, reader);
    for (int layer = 0; layer < layers_; ++layer) {
      glFramebufferTextureLayer(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, name_.get(), 0, layer);
      glCopyTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, layer, 0, 0, width_, height_);
    }
    glBindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(previous));
    glDeleteFramebuffers(1, &reader);
    TERRANE_TRY(context.checkErrors("copying a texture array into a larger one"));
  }
  name_ = std::move(grown);
  layers_ = wanted;
  return {};
}

void TextureArray::upload(int layer, const TexelRect& rect, const void* texels) {
  TERRANE_CHECK(layer >= 0 && layer < layers_, "layer {} of {}", layer, layers_);
  glBindTexture(GL_TEXTURE_2D_ARRAY, name_.get());
  glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, rect.x, rect.y, layer, rect.width, rect.height, 1, format_.format,
                  format_.type, texels);
}

void TextureArray::bindToUnit(int unit) const {
  bindUnit(GL_TEXTURE_2D_ARRAY, unit, name_.get());
}

}  // namespace terrane::gpu
