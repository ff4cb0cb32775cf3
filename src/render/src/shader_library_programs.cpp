#include <algorithm>
#include <utility>

#include "shader_library.h"

namespace terrane {

std::vector<gpu::ShaderFile> shaderFiles(const std::vector<std::string_view>& names) {
  std::vector<gpu::ShaderFile> out;
  for (const std::string_view name : names) {
    const auto& all = shaderFiles();
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const auto& file) { return file.name == name; });
    TERRANE_CHECK(found != all.end(), "no shader file {}", name);
    out.push_back(*found);
  }
  return out;
}

Result<gpu::Program> makeProgram(const gpu::Context& context, const ProgramRecipe& recipe,
                                 std::vector<std::string> captured) {
  TERRANE_ASSIGN(gpu::Program program,
                 gpu::Program::create(context, {.name = recipe.name,
                                                .vertex = shaderFiles(recipe.vertex),
                                                .fragment = shaderFiles(recipe.fragment),
                                                .captured = std::move(captured)}));
  program.bindBlock("FrameBlock", kFrameBinding);
  return program;
}

}  // namespace terrane
