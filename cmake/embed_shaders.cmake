# Writes OUTPUT, a C++ file with a function FUNCTION that gives the text of every file in FILES (separated by |) and
# is declared in HEADER: cmake -P embed_shaders.cmake
string(REPLACE "|" ";" files "${FILES}")
set(entries "")
foreach(file IN LISTS files)
  get_filename_component(name "${file}" NAME)
  file(READ "${file}" text)
  string(APPEND entries "    {\"${name}\", R\"glsl(${text})glsl\"},\n")
endforeach()
file(WRITE "${OUTPUT}" "// Made by cmake/embed_shaders.cmake.
#include \"${HEADER}\"

namespace terrane {

const std::vector<gpu::ShaderFile>& ${FUNCTION}() {
  static const std::vector<gpu::ShaderFile> files = {
${entries}  };
  return files;
}

}  // namespace terrane
")
