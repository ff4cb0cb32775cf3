#include "terrane/gpu/program.h"

#include <array>

namespace terrane::gpu {

namespace {

std::string shaderLog(GLuint shader) {
  GLint length = 0;
  glGetShaderiv(shader, GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<size_t>(std::max(length, 1)), '\0');
  glGetShaderInfoLog(shader, length, nullptr, log.data());
  return log.c_str();
}

std::string programLog(GLuint program) {
  GLint length = 0;
  glGetProgramiv(program, GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<size_t>(std::max(length, 1)), '\0');
  glGetProgramInfoLog(program, length, nullptr, log.data());
  return log.c_str();
}

/// Which file is which string number in the compiler's messages.
std::string fileLegend(const std::vector<ShaderFile>& files) {
  std::string out;
  for (size_t i = 0; i < files.size(); ++i)
    out += fmt::format("{}{} is {}", i == 0 ? "" : ", ", i + 1, files[i].name);
  return out;
}

Result<Name<deleteShader>> compile(const Context& context, const std::string& programName, GLenum stage,
                                   const std::vector<ShaderFile>& files) {
  // Each file counts its own lines: `#line 1 n` begins string number n.
  std::string text = context.shaderPrologue();
  for (size_t i = 0; i < files.size(); ++i) text += fmt::format("#line 1 {}\n{}\n", i + 1, files[i].text);
  Name<deleteShader> shader(glCreateShader(stage));
  const char* data = text.c_str();
  glShaderSource(shader.get(), 1, &data, nullptr);
  glCompileShader(shader.get());
  GLint compiled = 0;
  glGetShaderiv(shader.get(), GL_COMPILE_STATUS, &compiled);
  if (compiled == 0)
    return makeError("the {} shader of {} does not compile on {} ({}): {}",
                     stage == GL_VERTEX_SHADER ? "vertex" : "fragment", programName, context.rendererName(),
                     fileLegend(files), shaderLog(shader.get()));
  return shader;
}

}  // namespace

Result<Program> Program::create(const Context& context, const ProgramSource& source) {
  TERRANE_ASSIGN(const Name<deleteShader> vertex,
                 compile(context, source.name, GL_VERTEX_SHADER, source.vertex));
  TERRANE_ASSIGN(const Name<deleteShader> fragment,
                 compile(context, source.name, GL_FRAGMENT_SHADER, source.fragment));
  Name<deleteProgram> program(glCreateProgram());
  glAttachShader(program.get(), vertex.get());
  glAttachShader(program.get(), fragment.get());
  if (!source.captured.empty()) {
    std::vector<const char*> names;
    for (const std::string& name : source.captured) names.push_back(name.c_str());
    glTransformFeedbackVaryings(program.get(), static_cast<GLsizei>(names.size()), names.data(),
                                GL_INTERLEAVED_ATTRIBS);
  }
  glLinkProgram(program.get());
  GLint linked = 0;
  glGetProgramiv(program.get(), GL_LINK_STATUS, &linked);
  if (linked == 0)
    return makeError("the shaders of {} do not fit together on {}: {}", source.name, context.rendererName(),
                     programLog(program.get()));
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
