#pragma once

// The one place that includes OpenGL's headers. libepoxy resolves each function when it is first called, for
// desktop OpenGL and OpenGL ES alike.
#include <epoxy/gl.h>
