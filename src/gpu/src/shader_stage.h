#pragma once

#include <string>
#include <vector>

#include "terrane/gpu/program.h"

/// What programs of every kind are made by.
namespace terrane::gpu {

/// Compiles one stage; `stageWord` and `programName` are for the message.
Result<Name<deleteShader>> compileStage(const Context& context, const std::string& programName, GLenum stage,
                                        const char* stageWord, const std::vector<ShaderFile>& files);

/// Links what is attached.
Status linkProgram(const Context& context, const std::string& programName, GLuint program);

}  // namespace terrane::gpu
