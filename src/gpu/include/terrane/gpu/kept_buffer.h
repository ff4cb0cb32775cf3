#pragma once

#include <cstddef>

#include "terrane/base/result.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/name.h"

namespace terrane::gpu {

/// Vertices or indices that stay on the GPU, written piece by piece. It grows on demand, which keeps what is
/// there (a copy on the GPU).
class KeptBuffer {
 public:
  /// `target`: GL_ARRAY_BUFFER or GL_ELEMENT_ARRAY_BUFFER.
  explicit KeptBuffer(GLenum target) : target_(target) {}

  GLuint name() const { return name_.get(); }
  size_t sizeBytes() const { return sizeBytes_; }
  /// Makes it so large. Fails where the GPU's memory is full, and leaves it as it was. note: it is another
  /// buffer then; vertex arrays must be told.
  Status reserve(const Context& context, size_t sizeBytes);
  /// Replaces a piece; nothing that is still to be drawn from it may have been there.
  void write(size_t offsetBytes, const void* data, size_t sizeBytes);

 private:
  GLenum target_;
  Name<deleteBuffer> name_;
  size_t sizeBytes_ = 0;
};

}  // namespace terrane::gpu
