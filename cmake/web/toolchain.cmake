# Debian's emscripten, for the preset `web`. The libraries that are compiled for it lie in build/web-libraries, made by
# libraries.sh beside this file.
set(TERRANE_WEB_LIBRARIES ${CMAKE_CURRENT_LIST_DIR}/../../build/web-libraries)
get_filename_component(TERRANE_WEB_LIBRARIES ${TERRANE_WEB_LIBRARIES} ABSOLUTE)

find_program(TERRANE_EMCC emcc REQUIRED)
file(REAL_PATH ${TERRANE_EMCC} emcc)
get_filename_component(emscripten ${emcc} DIRECTORY)
include(${emscripten}/cmake/Modules/Platform/Emscripten.cmake)

# Errors are values in these folders, and so nothing may throw: what could catch it is not compiled in.
set(CMAKE_CXX_FLAGS_INIT "-msimd128 -fno-exceptions")

# Libraries come from there alone, never from /usr.
set(CMAKE_FIND_ROOT_PATH ${TERRANE_WEB_LIBRARIES})
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(ENV{PKG_CONFIG_LIBDIR} ${TERRANE_WEB_LIBRARIES}/lib/pkgconfig)

# note: emscripten links with acorn, which Debian keeps where node does not look by itself.
set_property(GLOBAL PROPERTY RULE_LAUNCH_LINK "${CMAKE_COMMAND} -E env NODE_PATH=/usr/share/nodejs")

# Programs run in node. note: with node's own fetch, what emscripten makes would fetch files as if they were URLs.
set(CMAKE_CROSSCOMPILING_EMULATOR "/usr/bin/node;--no-experimental-fetch")
