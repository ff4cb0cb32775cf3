#pragma once

#include <memory>
#include <span>
#include <string>

#include "terrane/base/result.h"
#include "terrane/gpu/gl.h"

namespace terrane::gpu {

/// The two dialects that Terrane speaks.
enum class Api {
  OpenGl,    ///< OpenGL 4.5 core, shaders in GLSL 4.50
  OpenGlEs,  ///< OpenGL ES 3.0, what WebGL2 is; shaders in GLSL ES 3.00
};

/// What to ask of a new context.
struct ContextOptions {
  Api api = Api::OpenGl;
  bool forceSoftware = false;      ///< Mesa's rasteriser even where there is a GPU
  bool forbidClipControl = false;  ///< behave as a driver without clip control, to test that path
};

/// What the driver allows.
struct Limits {
  int maxTextureSize = 0;
  int maxArrayLayers = 0;
  int maxSamples = 0;  ///< of a multi-sampled RGBA16F renderbuffer, at least 1
};

/// What drivers lack, each by name, so that no code asks for versions or vendors.
struct Workarounds {
  /// Depth cannot be reversed: clip space is always [-1, 1], which eats the precision that reversed depth
  /// gains. OpenGL ES without EXT_clip_control, so most of WebGL2. Then depth is the ordinary one.
  bool noClipControl = false;
  /// A fragment shader cannot run once a sample, so that edges which it makes itself (discard, drawn lines)
  /// stay jagged under multi-sampling. OpenGL ES 3.0. Then a larger picture is drawn and shrunk instead.
  bool noSampleShading = false;
  /// Running the fragment shader once a sample costs far more than drawing a larger picture: llvmpipe takes
  /// three times as long. Then a larger picture is drawn and shrunk instead.
  bool slowSampleShading = false;
  /// No timer query that can be waited for. OpenGL ES without EXT_disjoint_timer_query, and browsers. Then
  /// GPU times are not reported.
  bool noTimerQuery = false;
  /// A call draws one range of the indices: WebGL2, and OpenGL ES without EXT_multi_draw_arrays.
  bool noMultiDraw = false;
  /// Asking for errors waits until another process has done all that it was told, a quarter of a second where
  /// it makes the textures: browsers. Then nobody asks: a browser that has no memory for textures takes the
  /// context away, and tells the page.
  bool slowErrors = false;
};

/// An OpenGL context, current on the thread that made it, without a window, or of a page's canvas. All
/// objects of this folder belong to the context that is current when they are made, are used on that thread
/// only, and must be destroyed before the context is.
class Context {
 public:
  virtual ~Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// Outside browsers: a context for drawing into framebuffers only. Takes a GPU where there is one, else
  /// Mesa's software rasteriser. Fails where neither is installed.
  static Result<std::unique_ptr<Context>> createHeadless(const ContextOptions& options = {});

  /// In browsers: the WebGL2 context of the canvas that a CSS selector names. Pictures come onto it by
  /// Framebuffer::copyToWindow(). Fails where the browser has no WebGL2, or not enough of it.
  static Result<std::unique_ptr<Context>> createOnCanvas(const std::string& selector,
                                                         const ContextOptions& options = {});

  /// Makes this context the calling thread's current one.
  virtual void makeCurrent() = 0;

  Api api() const { return api_; }
  bool isGles() const { return api_ == Api::OpenGlEs; }
  /// The driver's own names: "llvmpipe (LLVM 15.0.6, 256 bits)", "4.5 (Core Profile) Mesa 22.3.6".
  const std::string& rendererName() const { return rendererName_; }
  const std::string& versionName() const { return versionName_; }
  /// Is it a software rasteriser?
  bool isSoftware() const { return isSoftware_; }
  const Limits& limits() const { return limits_; }
  const Workarounds& workarounds() const { return workarounds_; }

  /// The lines before every shader file: version, precisions and what differs between the dialects.
  std::string shaderPrologue() const;

  /// Clip space's depth: from 0 to 1, or OpenGL's own -1 to 1 (as it is at first). Not with noClipControl.
  void setClipDepthZeroToOne(bool zeroToOne) const;

  /// Runs the fragment shader for every sample, or once a pixel (as it is at first). Not with
  /// noSampleShading.
  void setSampleShading(bool everySample) const;

  /// Draws several ranges of the indices (uint32) of the vertex array that is bound, as triangles: `counts`
  /// indices from `offsetsBytes` on. Returns the number of draw calls, which is one where the driver can, but
  /// for `oneByOne`. note: in Mesa's software rasteriser gl_PrimitiveID goes on counting from range to range.
  int drawRanges(std::span<const GLsizei> counts, std::span<const void* const> offsetsBytes,
                 bool oneByOne = false) const;

  /// Lets the `buffer` blocks with that binding see a buffer. Desktop OpenGL only.
  void bindStorage(GLuint bindingPoint, GLuint buffer) const;

  /// An error if OpenGL has reported one since the last call; `doing` says what was being done. With
  /// slowErrors nothing is asked.
  Status checkErrors(const std::string& doing) const;
  /// The same after each frame.
  Status checkFrame(const std::string& doing) const;

 protected:
  Context() = default;
  /// Asks the driver (this context being current) for all that the accessors tell, and sets the state that
  /// never changes. Fails if something without which Terrane cannot draw is missing.
  Status readCapabilities(const ContextOptions& options);

 private:
  Api api_ = Api::OpenGl;
  std::string rendererName_;
  std::string versionName_;
  bool isSoftware_ = false;
  Limits limits_;
  Workarounds workarounds_;
};

}  // namespace terrane::gpu
