#pragma once

#include <vector>

#include "terrane/gpu/program.h"

namespace terrane {

/// The files in shaders/, compiled into the program.
const std::vector<gpu::ShaderFile>& drawShaderFiles();

}  // namespace terrane
