#pragma once

#include <cstdint>

#include "terrane/gpu/context.h"
#include "terrane/gpu/gl.h"

/// What drivers offer beyond OpenGL ES 3.0, and how to ask for it: driver_native.cpp through libepoxy,
/// driver_web.cpp in browsers. Of the context that is current.
namespace terrane::gpu::driver {

/// Is it the wanted dialect in a version that suffices?
bool speaks(Api api);
/// What to ask glGetString() for the name of what draws.
GLenum rendererNameKey();
/// What an OpenGL ES context may lack, in Workarounds' words; nothing of it for desktop OpenGL.
bool hasFloatTargets(Api api);
bool hasClipControl(Api api);
bool hasSampleShading(Api api);
bool hasTimerQuery(Api api);
/// Does asking for errors, or reading back, wait for another process?
bool isRemote();

/// Only with what is asked for above.
void setClipDepthZeroToOne(Api api, bool zeroToOne);
void setSampleShading(bool everySample);
void bindStorage(GLuint bindingPoint, GLuint buffer);
bool hasMultiDraw(Api api);
/// Triangles by uint32 indices. Only with hasMultiDraw().
void multiDrawElements(Api api, const GLsizei* counts, const void* const* offsets, GLsizei draws);
void beginTimer(GLuint query);
void endTimer();
/// Nanoseconds of the last begin to end; waits for them.
uint64_t timerNanoseconds(Api api, GLuint query);

}  // namespace terrane::gpu::driver
