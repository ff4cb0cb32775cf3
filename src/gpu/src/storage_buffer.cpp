#include "terrane/gpu/storage_buffer.h"

#include <algorithm>

#include "terrane/base/check.h"

namespace terrane::gpu {

StorageBuffer::StorageBuffer() {
  GLuint name = 0;
  glCreateBuffers(1, &name);
  name_ = Name<deleteBuffer>(name);
}

size_t StorageBuffer::maxBytes() {
  GLint64 bytes = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &bytes);
  return static_cast<size_t>(std::max<GLint64>(bytes, 0));
}

void StorageBuffer::upload(const void* data, size_t sizeBytes) {
  if (sizeBytes > capacityBytes_) {
    capacityBytes_ = sizeBytes;
    glNamedBufferData(name_.get(), static_cast<GLsizeiptr>(sizeBytes), nullptr, GL_DYNAMIC_COPY);
  }
  if (data != nullptr && sizeBytes > 0)
    glNamedBufferSubData(name_.get(), 0, static_cast<GLsizeiptr>(sizeBytes), data);
  sizeBytes_ = sizeBytes;
}

void StorageBuffer::bindTo(int bindingPoint) const {
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, static_cast<GLuint>(bindingPoint), name_.get());
}

void StorageBuffer::read(void* data, size_t sizeBytes) const {
  TERRANE_CHECK(sizeBytes <= sizeBytes_, "{} of {} bytes", sizeBytes, sizeBytes_);
  if (sizeBytes > 0) glGetNamedBufferSubData(name_.get(), 0, static_cast<GLsizeiptr>(sizeBytes), data);
}

}  // namespace terrane::gpu
