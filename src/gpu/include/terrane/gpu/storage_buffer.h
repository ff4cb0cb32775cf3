#pragma once

#include <cstddef>

#include "terrane/gpu/name.h"

namespace terrane::gpu {

/// Bytes that compute shaders read and write (a `buffer` block, std430). Desktop OpenGL only: not in
/// browsers, and not for a context of OpenGL ES.
class StorageBuffer {
 public:
  StorageBuffer();

  GLuint name() const { return name_.get(); }
  size_t sizeBytes() const { return sizeBytes_; }
  /// The most bytes that a shader can see of one.
  static size_t maxBytes();

  /// Replaces the content; `data` may be null: then the bytes are undefined. Storage is kept while it
  /// suffices.
  void upload(const void* data, size_t sizeBytes);
  /// Lets the blocks with `layout(binding = bindingPoint)` see it.
  void bindTo(int bindingPoint) const;
  /// Copies the first bytes out, after all that was told to write them. Waits for it.
  void read(void* data, size_t sizeBytes) const;

 private:
  Name<deleteBuffer> name_;
  size_t sizeBytes_ = 0;
  size_t capacityBytes_ = 0;
};

}  // namespace terrane::gpu
