#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>

#include "line_layer.h"
#include "pass_chain.h"
#include "terrane/base/result.h"
#include "terrane/gpu/framebuffer.h"
#include "terrane/gpu/program.h"

namespace terrane {

/// What happens between the finished ground and the picture that is shown, where a caller wants more: lines
/// on the ground, then passes. Linear light, one pixel for each of the picture's, with the place under it.
class PictureStages {
 public:
  explicit PictureStages(gpu::Context& context) : lines(context), passes(context), context_(context) {}

  LineLayer lines;
  PassChain passes;

  bool isEmpty() const { return lines.isEmpty() && passes.size() == 0; }
  /// Runs them all. `scene` has `shrink` pixels along the side of each of the picture's. Gives what to
  /// present, as large as the picture. Error: the GPU cannot hold the pictures on the way.
  Result<const gpu::Texture*> run(const gpu::Texture& scene, int shrink, const gpu::Texture& places,
                                  const Camera& camera, double exaggeration);

 private:
  Status prepare(const Camera& camera);

  gpu::Context& context_;
  std::unique_ptr<gpu::Program> shrink_;  ///< made when it is first needed
  std::array<std::optional<gpu::Framebuffer>, 2> pictures_;
  gpu::VertexArray nothing_;
};

}  // namespace terrane
