#pragma once

#include <cstddef>

#include "terrane/gpu/buffer.h"
#include "terrane/gpu/name.h"

namespace terrane::gpu {

/// One vertex attribute: which location, how many numbers of which type, where in the record.
struct Attribute {
  GLuint location = 0;
  GLint components = 4;
  GLenum type = GL_FLOAT;  ///< integer types arrive as integers in the shader
  size_t offsetBytes = 0;
  GLsizei strideBytes = 0;
  GLuint divisor = 0;  ///< 0: one a vertex; 1: one an instance
};

/// From which buffers a draw call reads its vertices, indices and instances.
class VertexArray {
 public:
  VertexArray();
  void bind() const { glBindVertexArray(name_.get()); }
  /// Reads an attribute from `buffer`. Binds this vertex array.
  void setAttribute(GLuint buffer, const Attribute& attribute) const;
  void setAttribute(const Buffer& buffer, const Attribute& attribute) const {
    setAttribute(buffer.name(), attribute);
  }
  /// Reads indices from `buffer`. Binds this vertex array.
  void setIndices(GLuint buffer) const;
  void setIndices(const Buffer& buffer) const { setIndices(buffer.name()); }

 private:
  Name<deleteVertexArray> name_;
};

}  // namespace terrane::gpu
