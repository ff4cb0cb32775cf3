#pragma once

// The one place that includes OpenGL's headers. Outside browsers libepoxy resolves each function when it is
// first called, for desktop OpenGL and OpenGL ES alike; in browsers there is what WebGL2 has, OpenGL ES 3.0.
#ifdef __EMSCRIPTEN__
#include <GLES3/gl3.h>
#else
#include <epoxy/gl.h>
#endif
