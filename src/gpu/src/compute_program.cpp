#include "terrane/gpu/compute_program.h"

#include "shader_stage.h"

namespace terrane::gpu {

Result<ComputeProgram> ComputeProgram::create(const Context& context, const std::string& name,
                                              const std::vector<ShaderFile>& files) {
  if (context.isGles())
    return makeError("{} needs compute shaders, which only the context of desktop OpenGL has", name);
  TERRANE_ASSIGN(const Name<deleteShader> shader,
                 compileStage(context, name, GL_COMPUTE_SHADER, "compute", files));
  Name<deleteProgram> program(glCreateProgram());
  glAttachShader(program.get(), shader.get());
  TERRANE_TRY(linkProgram(context, name, program.get()));
  glDetachShader(program.get(), shader.get());
  return ComputeProgram(std::move(program));
}

void ComputeProgram::dispatch(size_t groupsX, size_t groupsY) const {
  glUseProgram(name_.get());
  glDispatchCompute(static_cast<GLuint>(groupsX), static_cast<GLuint>(groupsY), 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                  GL_VERTEX_ATTRIB_ARRAY_BARRIER_BIT | GL_ELEMENT_ARRAY_BARRIER_BIT);
}

}  // namespace terrane::gpu
