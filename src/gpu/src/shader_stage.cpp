#include "shader_stage.h"

#include <algorithm>

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

}  // namespace

Result<Name<deleteShader>> compileStage(const Context& context, const std::string& programName, GLenum stage,
                                        const char* stageWord, const std::vector<ShaderFile>& files) {
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
    return makeError("the {} shader of {} does not compile on {} ({}): {}", stageWord, programName,
                     context.rendererName(), fileLegend(files), shaderLog(shader.get()));
  return shader;
}

Status linkProgram(const Context& context, const std::string& programName, GLuint program) {
  glLinkProgram(program);
  GLint linked = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &linked);
  if (linked == 0)
    return makeError("the shaders of {} do not fit together on {}: {}", programName, context.rendererName(),
                     programLog(program));
  return {};
}

}  // namespace terrane::gpu
