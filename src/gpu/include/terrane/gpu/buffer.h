#pragma once

#include <cstddef>

#include "terrane/gpu/name.h"

namespace terrane::gpu {

/// Bytes on the GPU: vertices, indices, instances or uniforms, by the target it is made for.
class Buffer {
 public:
  /// `target`: GL_ARRAY_BUFFER, GL_ELEMENT_ARRAY_BUFFER, GL_UNIFORM_BUFFER or GL_TRANSFORM_FEEDBACK_BUFFER.
  explicit Buffer(GLenum target);

  GLuint name() const { return name_.get(); }
  size_t sizeBytes() const { return sizeBytes_; }

  void bind() const { glBindBuffer(target_, name_.get()); }
  /// Replaces the whole content, growing where needed and never stalling on what is still being drawn. `data`
  /// may be null: then the bytes are undefined. Leaves the buffer bound.
  /// note: an element buffer belongs to the vertex array that is bound; bind the right one before.
  void upload(const void* data, size_t sizeBytes);

 private:
  GLenum target_;
  Name<deleteBuffer> name_;
  size_t sizeBytes_ = 0;
  size_t capacityBytes_ = 0;
};

}  // namespace terrane::gpu
