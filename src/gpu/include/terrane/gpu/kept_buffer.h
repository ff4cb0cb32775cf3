#pragma once

#include <cstddef>
#include <span>

#include "terrane/base/result.h"
#include "terrane/gpu/buffer.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/name.h"

namespace terrane::gpu {

/// Vertices or indices that stay on the GPU, written piece by piece. It grows on demand, which keeps what is
/// there (a copy on the GPU).
class KeptBuffer {
 public:
  /// `target`: GL_ARRAY_BUFFER or GL_ELEMENT_ARRAY_BUFFER.
  explicit KeptBuffer(GLenum target) : target_(target), arrived_(target) {}

  GLuint name() const { return name_.get(); }
  size_t sizeBytes() const { return sizeBytes_; }
  /// Makes it so large. Fails where the GPU's memory is full, and leaves it as it was. note: it is another
  /// buffer then; vertex arrays must be told.
  Status reserve(const Context& context, size_t sizeBytes);
  struct Piece {
    size_t offsetBytes = 0;
    size_t sizeBytes = 0;
  };
  /// Replaces pieces; nothing that is still to be drawn from them may have been there. `data` has them one
  /// after the other: it is uploaded as one, which costs as much as a single piece, and copied to its places
  /// there.
  void write(std::span<const Piece> pieces, const void* data);

 private:
  GLenum target_;
  Buffer arrived_;  ///< what was uploaded last
  Name<deleteBuffer> name_;
  size_t sizeBytes_ = 0;
};

}  // namespace terrane::gpu
