#pragma once

#include <utility>

#include "terrane/gpu/gl.h"

namespace terrane::gpu {

/// Owns the name of one OpenGL object and deletes it; move-only. 0 is no object.
template <void (*Delete)(GLuint)>
class Name {
 public:
  Name() = default;
  explicit Name(GLuint name) : name_(name) {}
  Name(Name&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  Name& operator=(Name&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  Name(const Name&) = delete;
  Name& operator=(const Name&) = delete;
  ~Name() {
    if (name_ != 0) Delete(name_);
  }
  GLuint get() const { return name_; }

 private:
  GLuint name_ = 0;
};

inline void deleteBuffer(GLuint name) {
  glDeleteBuffers(1, &name);
}
inline void deleteTexture(GLuint name) {
  glDeleteTextures(1, &name);
}
inline void deleteRenderbuffer(GLuint name) {
  glDeleteRenderbuffers(1, &name);
}
inline void deleteFramebuffer(GLuint name) {
  glDeleteFramebuffers(1, &name);
}
inline void deleteVertexArray(GLuint name) {
  glDeleteVertexArrays(1, &name);
}
inline void deleteShader(GLuint name) {
  glDeleteShader(name);
}
inline void deleteProgram(GLuint name) {
  glDeleteProgram(name);
}
inline void deleteQuery(GLuint name) {
  glDeleteQueries(1, &name);
}

}  // namespace terrane::gpu
