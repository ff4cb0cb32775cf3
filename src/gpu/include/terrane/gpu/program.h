#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/name.h"

namespace terrane::gpu {

/// The text of one shader file: no `#version`, no precisions.
struct ShaderFile {
  std::string_view name;
  std::string_view text;
};

/// What a program is made of: each stage is the context's prologue and then its files, in order.
struct ProgramSource {
  std::string name;  ///< for messages
  std::vector<ShaderFile> vertex;
  std::vector<ShaderFile> fragment;
  /// Outputs of the vertex stage to capture by transform feedback, interleaved; usually none.
  std::vector<std::string> captured;
};

/// A linked vertex and fragment shader.
class Program {
 public:
  /// Compiles and links. The error names the file and line and holds the compiler's words.
  static Result<Program> create(const Context& context, const ProgramSource& source);

  GLuint name() const { return name_.get(); }
  void use() const { glUseProgram(name_.get()); }
  /// Lets the sampler uniform read from a texture unit. Unknown names (optimised away) are ignored.
  void setSampler(const char* uniform, int unit) const;
  void setInt(const char* uniform, int value) const;
  void setFloat(const char* uniform, float value) const;
  /// A vec2 to vec4, or an ivec2 to ivec4, by the number of values.
  void setFloats(const char* uniform, std::span<const float> values) const;
  void setInts(const char* uniform, std::span<const int> values) const;
  /// A uniform outside of blocks that is there, as the driver tells it.
  struct Uniform {
    std::string name;
    GLenum type = 0;
    int count = 1;  ///< of an array
  };
  std::vector<Uniform> uniforms() const;
  /// Lets the uniform block read from a binding point; unknown blocks are ignored.
  void bindBlock(const char* block, int bindingPoint) const;

 private:
  explicit Program(Name<deleteProgram> name) : name_(std::move(name)) {}
  Name<deleteProgram> name_;
};

}  // namespace terrane::gpu
