#pragma once

#include <memory>

#include "prepared_lines.h"
#include "terrane/base/result.h"
#include "terrane/gpu/framebuffer.h"
#include "terrane/gpu/program.h"
#include "terrane/gpu/texture.h"
#include "terrane/gpu/vertex_array.h"
#include "terrane/tiling/camera.h"

namespace terrane {

/// Lines on the ground, on the GPU: a full-screen stage finds for each pixel the segments near the place
/// under it.
class LineLayer {
 public:
  explicit LineLayer(gpu::Context& context);

  /// Replaces all lines. Errors: the GPU cannot hold them, or the driver does not take the shader; then there
  /// are none.
  Status set(const PreparedLines& lines);
  bool isEmpty() const { return grid_.levels == 0; }
  size_t gpuBytes() const { return cells_.sizeBytes() + entries_.sizeBytes() + styles_.sizeBytes(); }

  /// Blends them into `picture` (linear light), for the places under its pixels; the frame's block, made for
  /// the picture's size, is bound.
  void draw(const gpu::Texture& places, const Camera& camera, const gpu::Framebuffer& picture);

 private:
  Status upload(gpu::TextureArray& target, const void* texels, size_t count) const;

  gpu::Context& context_;
  std::unique_ptr<gpu::Program> program_;  ///< made with the first lines
  LineGrid grid_;                          ///< without what is on the GPU
  int slotCount_ = 0;
  gpu::TextureArray cells_;
  gpu::TextureArray entries_;
  gpu::TextureArray styles_;
  gpu::VertexArray nothing_;
};

}  // namespace terrane
