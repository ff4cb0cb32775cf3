#include "pass_chain.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "shader_library.h"
#include "stage_units.h"

namespace terrane {
namespace {

/// The line of a word in GLSL text, from 1, comments not counted; 0 where it is not.
int lineOfWord(std::string_view text, std::string_view word) {
  const auto isPart = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  int line = 1;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\n') ++line;
    if (text.substr(i, 2) == "//") {
      i = std::min(text.find('\n', i), text.size()) - 1;
    } else if (text.substr(i, 2) == "/*") {
      const size_t end = std::min(text.find("*/", i + 2), text.size());
      line += static_cast<int>(std::count(text.begin() + static_cast<std::ptrdiff_t>(i),
                                          text.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
      i = end + 1;
    } else if (isPart(text[i])) {
      size_t end = i;
      while (end < text.size() && isPart(text[end])) ++end;
      if (text.substr(i, end - i) == word) return line;
      i = end - 1;
    }
  }
  return 0;
}

bool isOurs(const std::string& uniform) {
  return uniform.rfind("terrane", 0) == 0;
}

/// How many numbers a uniform takes; 0 where it is of another kind.
size_t numbersOf(const gpu::Program::Uniform& uniform) {
  if (uniform.count != 1) return 0;
  switch (uniform.type) {
    case GL_FLOAT:
      return 1;
    case GL_FLOAT_VEC2:
      return 2;
    case GL_FLOAT_VEC3:
      return 3;
    case GL_FLOAT_VEC4:
      return 4;
    default:
      return 0;
  }
}

std::array<float, 3> floats(glm::dvec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

}  // namespace

std::vector<PassChain::Pass>::iterator PassChain::find(const std::string& name) {
  return std::find_if(passes_.begin(), passes_.end(), [&](const Pass& pass) { return pass.name == name; });
}

Status PassChain::set(const std::string& name, std::string_view fragment, glm::dvec3 originLocal) {
  // A pixel that a pass leaves out would show whatever was drawn there before.
  if (const int line = lineOfWord(fragment, "discard"); line > 0)
    return makeError("pass {}, line {}: 'discard' is not for passes; return ground.color instead", name,
                     line);
  const ProgramRecipe recipe = ProgramRecipes{}.groundPass;
  std::vector<gpu::ShaderFile> files = shaderFiles(recipe.fragment);
  files.insert(files.begin() + 1, {name, fragment});
  TERRANE_ASSIGN(gpu::Program program, gpu::Program::create(context_, {.name = "pass " + name,
                                                                       .vertex = shaderFiles(recipe.vertex),
                                                                       .fragment = files,
                                                                       .captured = {}}));
  for (const gpu::Program::Uniform& uniform : program.uniforms())
    if (!isOurs(uniform.name) && numbersOf(uniform) == 0)
      return makeError("pass {}: uniform {} is of a kind that passes do not have: float, vec2, vec3 or vec4",
                       name, uniform.name);
  program.bindBlock("FrameBlock", kFrameBinding);
  program.setSampler("terraneScene", kStageSceneUnit);
  program.setSampler("terranePlaces", kPlacesUnit);
  if (const auto at = find(name); at != passes_.end())
    *at = Pass{name, std::move(program), originLocal};
  else
    passes_.push_back(Pass{name, std::move(program), originLocal});
  return {};
}

void PassChain::move(const std::string& name, glm::dvec3 originLocal) {
  if (const auto at = find(name); at != passes_.end()) at->originLocal = originLocal;
}

void PassChain::remove(const std::string& name) {
  if (const auto at = find(name); at != passes_.end()) passes_.erase(at);
}

Status PassChain::setUniform(const std::string& name, const std::string& uniform,
                             std::span<const float> values) {
  const auto at = find(name);
  if (at == passes_.end()) return makeError("there is no pass {}", name);
  for (const gpu::Program::Uniform& known : at->program.uniforms()) {
    if (known.name != uniform || isOurs(uniform)) continue;
    if (numbersOf(known) != values.size())
      return makeError("pass {}: uniform {} takes {} numbers, not {}", name, uniform, numbersOf(known),
                       values.size());
    at->program.setFloats(uniform.c_str(), values);
  }
  // note: one that the pass does not use is none to the driver; setting it changes nothing.
  return {};
}

void PassChain::draw(size_t index, const gpu::Texture& from, const gpu::Texture& places, const Camera& camera,
                     double exaggeration, const gpu::Framebuffer& to) const {
  const Pass& pass = passes_[index];
  const glm::dvec3 eye =
      glm::dvec3(camera.eyeLocal.x, camera.eyeLocal.y, camera.eyeLocal.z / exaggeration) - pass.originLocal;
  pass.program.setFloats("terraneEye",
                         std::array<float, 4>{static_cast<float>(eye.x), static_cast<float>(eye.y),
                                              static_cast<float>(eye.z), static_cast<float>(exaggeration)});
  pass.program.setFloats("terraneViewRight", floats(camera.tanHalfX() * camera.right));
  pass.program.setFloats("terraneViewUp", floats(camera.tanHalfY() * camera.up));
  pass.program.setFloats("terraneViewForward", floats(camera.forward));
  from.bindToUnit(kStageSceneUnit);
  places.bindToUnit(kPlacesUnit);
  to.bind();
  pass.program.use();
  nothing_.bind();
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glBindVertexArray(0);
}

}  // namespace terrane
