# Writes OUTPUT, a C++ file with the text of every file in FILES (separated by |): cmake -P embed_shaders.cmake
string(REPLACE "|" ";" files "${FILES}")
set(entries "")
foreach(file IN LISTS files)
  get_filename_component(name "${file}" NAME)
  file(READ "${file}" text)
  string(APPEND entries "    {\"${name}\", R\"glsl(${text})glsl\"},\n")
endforeach()
file(WRITE "${OUTPUT}" "// Made by src/render/embed_shaders.cmake from src/render/shaders.
#include \"shader_library.h\"

namespace terrane {

const std::vector<gpu::ShaderFile>& shaderFiles() {
  static const std::vector<gpu::ShaderFile> files = {
${entries}  };
  return files;
}

}  // namespace terrane
")
