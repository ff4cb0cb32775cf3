#include "terrane/gpu/buffer.h"

#include <algorithm>

namespace terrane::gpu {

Buffer::Buffer(GLenum target) : target_(target) {
  GLuint name = 0;
  glGenBuffers(1, &name);
  name_ = Name<deleteBuffer>(name);
}

void Buffer::upload(const void* data, size_t sizeBytes) {
  bind();
  // Fresh storage each time lets the driver keep the old one for what is in flight.
  if (sizeBytes > capacityBytes_) capacityBytes_ = std::max(sizeBytes, capacityBytes_ + capacityBytes_ / 2);
  glBufferData(target_, static_cast<GLsizeiptr>(capacityBytes_), nullptr, GL_DYNAMIC_DRAW);
  if (data != nullptr && sizeBytes > 0) glBufferSubData(target_, 0, static_cast<GLsizeiptr>(sizeBytes), data);
  sizeBytes_ = sizeBytes;
}

}  // namespace terrane::gpu
