#include "terrane/gpu/program.h"

#include "shader_stage.h"

namespace terrane::gpu {

Result<Program> Program::create(const Context& context, const ProgramSource& source) {
  TERRANE_ASSIGN(const Name<deleteShader> vertex,
                 compileStage(context, source.name, GL_VERTEX_SHADER, "vertex", source.vertex));
  TERRANE_ASSIGN(const Name<deleteShader> fragment,
                 compileStage(context, source.name, GL_FRAGMENT_SHADER, "fragment", source.fragment));
  Name<deleteProgram> program(glCreateProgram());
  glAttachShader(program.get(), vertex.get());
  glAttachShader(program.get(), fragment.get());
  if (!source.captured.empty()) {
    std::vector<const char*> names;
    for (const std::string& name : source.captured) names.push_back(name.c_str());
    glTransformFeedbackVaryings(program.get(), static_cast<GLsizei>(names.size()), names.data(),
                                GL_INTERLEAVED_ATTRIBS);
  }
  TERRANE_TRY(linkProgram(context, source.name, program.get()));
  glDetachShader(program.get(), vertex.get());
  glDetachShader(program.get(), fragment.get());
  return Program(std::move(program));
}

void Program::setSampler(const char* uniform, int unit) const {
  setInt(uniform, unit);
}

void Program::setInt(const char* uniform, int value) const {
  use();
  const GLint location = glGetUniformLocation(name_.get(), uniform);
  if (location >= 0) glUniform1i(location, value);
}

void Program::bindBlock(const char* block, int bindingPoint) const {
  const GLuint index = glGetUniformBlockIndex(name_.get(), block);
  if (index != GL_INVALID_INDEX) glUniformBlockBinding(name_.get(), index, static_cast<GLuint>(bindingPoint));
}

}  // namespace terrane::gpu
