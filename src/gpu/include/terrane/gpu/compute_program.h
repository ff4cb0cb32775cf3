#pragma once

#include <string>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/name.h"
#include "terrane/gpu/program.h"

namespace terrane::gpu {

/// A linked compute shader. Desktop OpenGL only: not in browsers, and not for a context of OpenGL ES.
class ComputeProgram {
 public:
  /// Compiles and links the context's prologue and then the files, in order. The error names the file and
  /// line and holds the compiler's words; also for a context of OpenGL ES.
  static Result<ComputeProgram> create(const Context& context, const std::string& name,
                                       const std::vector<ShaderFile>& files);

  GLuint name() const { return name_.get(); }
  /// Runs that many work groups; 0 in either direction is none. What it writes into storage buffers, later
  /// dispatches, draws and reads see.
  void dispatch(size_t groupsX, size_t groupsY) const;

 private:
  explicit ComputeProgram(Name<deleteProgram> name) : name_(std::move(name)) {}
  Name<deleteProgram> name_;
};

}  // namespace terrane::gpu
