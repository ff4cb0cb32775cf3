#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "terrane/gpu/program.h"

namespace terrane {

/// Every file of src/render/shaders, compiled into the library.
const std::vector<gpu::ShaderFile>& shaderFiles();

/// The files of that names, in that order; they must exist.
std::vector<gpu::ShaderFile> shaderFiles(const std::vector<std::string_view>& names);

/// What a program of this folder is made of.
struct ProgramRecipe {
  std::string name;
  std::vector<std::string_view> vertex;
  std::vector<std::string_view> fragment;
};
/// All programs: drawing makes them from here, and the tests compile each of them in both dialects.
struct ProgramRecipes {
  ProgramRecipe shade{
      "the ground",
      {"frame.glsl", "place.glsl", "morph.glsl", "patch.vert"},
      {"frame.glsl", "sky.glsl", "coverage.glsl", "imagery.glsl", "shading_normal.glsl", "patch_shade.frag"}};
  ProgramRecipe position{"the position buffer",
                         {"frame.glsl", "place.glsl", "morph.glsl", "patch.vert"},
                         {"frame.glsl", "place.glsl", "morph.glsl", "coverage.glsl", "shading_normal.glsl",
                          "patch_position.frag"}};
  ProgramRecipe meshShade{
      "the ground of meshes",
      {"frame.glsl", "place.glsl", "mesh_patch.glsl", "mesh.vert"},
      {"frame.glsl", "sky.glsl", "coverage.glsl", "imagery.glsl", "shading_normal.glsl", "patch_shade.frag"}};
  ProgramRecipe meshPosition{"the position buffer of meshes",
                             {"frame.glsl", "place.glsl", "mesh_patch.glsl", "mesh.vert"},
                             {"frame.glsl", "place.glsl", "mesh_patch.glsl", "coverage.glsl",
                              "shading_normal.glsl", "mesh_position.frag"}};
  ProgramRecipe meshLine{"the sides of meshes' triangles",
                         {"frame.glsl", "place.glsl", "mesh_patch.glsl", "mesh.vert"},
                         {"frame.glsl", "sky.glsl", "coverage.glsl", "mesh_line.frag"}};
  ProgramRecipe sky{"the sky", {"frame.glsl", "fullscreen.vert"}, {"frame.glsl", "sky.glsl", "sky.frag"}};
  ProgramRecipe present{
      "the finished picture", {"frame.glsl", "fullscreen.vert"}, {"frame.glsl", "present.frag"}};
  ProgramRecipe line{"lines", {"line.vert"}, {"line.frag"}};
  ProgramRecipe shrink{"the finished scene", {"frame.glsl", "fullscreen.vert"}, {"shrink.frag"}};
  ProgramRecipe groundLines{
      "lines on the ground", {"frame.glsl", "fullscreen.vert"}, {"frame.glsl", "ground_lines.frag"}};
  /// Of a caller's pass, whose own text comes between the two files of the fragment stage.
  ProgramRecipe groundPass{
      "a pass", {"frame.glsl", "fullscreen.vert"}, {"ground_pass.glsl", "ground_pass.frag"}};
};

/// Compiles and links a recipe; its FrameBlock reads from kFrameBinding.
Result<gpu::Program> makeProgram(const gpu::Context& context, const ProgramRecipe& recipe,
                                 std::vector<std::string> captured = {});
inline constexpr int kFrameBinding = 0;

}  // namespace terrane
