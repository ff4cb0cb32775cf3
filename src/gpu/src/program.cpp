#include "terrane/gpu/program.h"

#include <array>

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

void Program::setFloat(const char* uniform, float value) const {
  use();
  const GLint location = glGetUniformLocation(name_.get(), uniform);
  if (location >= 0) glUniform1f(location, value);
}

void Program::setFloats(const char* uniform, std::span<const float> values) const {
  use();
  const GLint location = glGetUniformLocation(name_.get(), uniform);
  if (location < 0) return;
  if (values.size() == 1) glUniform1fv(location, 1, values.data());
  if (values.size() == 2) glUniform2fv(location, 1, values.data());
  if (values.size() == 3) glUniform3fv(location, 1, values.data());
  if (values.size() == 4) glUniform4fv(location, 1, values.data());
}

void Program::setInts(const char* uniform, std::span<const int> values) const {
  use();
  const GLint location = glGetUniformLocation(name_.get(), uniform);
  if (location < 0) return;
  if (values.size() == 1) glUniform1iv(location, 1, values.data());
  if (values.size() == 2) glUniform2iv(location, 1, values.data());
  if (values.size() == 3) glUniform3iv(location, 1, values.data());
  if (values.size() == 4) glUniform4iv(location, 1, values.data());
}

std::vector<Program::Uniform> Program::uniforms() const {
  GLint count = 0;
  glGetProgramiv(name_.get(), GL_ACTIVE_UNIFORMS, &count);
  std::vector<Uniform> out;
  for (GLint i = 0; i < count; ++i) {
    std::array<char, 256> name{};
    GLsizei length = 0;
    GLint size = 0;
    GLenum type = 0;
    glGetActiveUniform(name_.get(), static_cast<GLuint>(i), static_cast<GLsizei>(name.size()), &length, &size,
                       &type, name.data());
    const std::string text(name.data(), static_cast<size_t>(length));
    // Members of blocks have no location.
    if (glGetUniformLocation(name_.get(), text.c_str()) >= 0) out.push_back({text, type, size});
  }
  return out;
}

void Program::bindBlock(const char* block, int bindingPoint) const {
  const GLuint index = glGetUniformBlockIndex(name_.get(), block);
  if (index != GL_INVALID_INDEX) glUniformBlockBinding(name_.get(), index, static_cast<GLuint>(bindingPoint));
}

}  // namespace terrane::gpu
