#include "terrane/gpu/vertex_array.h"

namespace terrane::gpu {

VertexArray::VertexArray() {
  GLuint name = 0;
  glGenVertexArrays(1, &name);
  name_ = Name<deleteVertexArray>(name);
}

void VertexArray::setAttribute(GLuint buffer, const Attribute& attribute) const {
  bind();
  glBindBuffer(GL_ARRAY_BUFFER, buffer);
  const void* offset = reinterpret_cast<const void*>(attribute.offsetBytes);
  if (attribute.type == GL_FLOAT)
    glVertexAttribPointer(attribute.location, attribute.components, attribute.type, GL_FALSE,
                          attribute.strideBytes, offset);
  else
    glVertexAttribIPointer(attribute.location, attribute.components, attribute.type, attribute.strideBytes,
                           offset);
  glEnableVertexAttribArray(attribute.location);
  glVertexAttribDivisor(attribute.location, attribute.divisor);
}

void VertexArray::setIndices(GLuint buffer) const {
  bind();
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffer);
}

}  // namespace terrane::gpu
