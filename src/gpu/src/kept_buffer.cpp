#include "terrane/gpu/kept_buffer.h"

#include <fmt/format.h>

namespace terrane::gpu {

Status KeptBuffer::reserve(const Context& context, size_t sizeBytes) {
  if (sizeBytes <= sizeBytes_) return {};
  GLuint made = 0;
  glGenBuffers(1, &made);
  Name<deleteBuffer> name(made);
  // note: an element buffer's own target belongs to the vertex array that is bound; and in browsers a buffer
  // that was bound to another target first never becomes one.
  glBindVertexArray(0);
  glBindBuffer(target_, made);
  glBufferData(target_, static_cast<GLsizeiptr>(sizeBytes), nullptr, GL_DYNAMIC_DRAW);
  TERRANE_TRY(context.checkErrors(fmt::format("making room for {} bytes of meshes", sizeBytes)));
  if (sizeBytes_ > 0) {
    glBindBuffer(GL_COPY_READ_BUFFER, name_.get());
    glBindBuffer(GL_COPY_WRITE_BUFFER, made);
    glCopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, 0, 0, static_cast<GLsizeiptr>(sizeBytes_));
    glBindBuffer(GL_COPY_READ_BUFFER, 0);
    glBindBuffer(GL_COPY_WRITE_BUFFER, 0);
  }
  name_ = std::move(name);
  sizeBytes_ = sizeBytes;
  return {};
}

void KeptBuffer::write(size_t offsetBytes, const void* data, size_t sizeBytes) {
  glBindVertexArray(0);
  glBindBuffer(target_, name_.get());
  glBufferSubData(target_, static_cast<GLintptr>(offsetBytes), static_cast<GLsizeiptr>(sizeBytes), data);
}

}  // namespace terrane::gpu
