#pragma once

#include <vector>

#include "terrane/gpu/program.h"

namespace terrane {

/// The decoder's shader, strip_decode.comp, compiled into the library.
const std::vector<gpu::ShaderFile>& stripShaderFiles();

}  // namespace terrane
