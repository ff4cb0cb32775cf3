#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/codec/strip_mesh.h"
#include "terrane/gpu/compute_program.h"
#include "terrane/gpu/storage_buffer.h"

namespace terrane {

/// Decodes strip meshes on the GPU, by a compute shader, into the very words that decodeStripMesh() gives. On
/// the thread whose context is current.
class StripGpuDecoder {
 public:
  /// Error: the context's shaders cannot compute, or the driver refuses this one.
  static Result<StripGpuDecoder> create(const gpu::Context& context);

  /// Copies meshes to the GPU, in the place of those that were there; many tiles are decoded at once.
  /// Precondition: validateStripMesh() is content with each, since the shader checks nothing. Error: more
  /// than the driver has room for.
  Status upload(const gpu::Context& context, std::span<const StripMesh> meshes);
  /// Decodes all that was uploaded; returns without waiting for it.
  void decode();

  /// Three packed vertices a triangle, tile after tile, as the GPU has them for drawing.
  const gpu::StorageBuffer& vertices() const { return vertices_; }
  size_t triangleCount() const { return triangleCount_; }
  /// Waits, and copies them back.
  std::vector<uint32_t> readVertices() const;

 private:
  explicit StripGpuDecoder(gpu::ComputeProgram program) : program_(std::move(program)) {}

  gpu::ComputeProgram program_;
  gpu::StorageBuffer tiles_;
  gpu::StorageBuffer headers_;
  gpu::StorageBuffer entries_;
  gpu::StorageBuffer vertices_;
  size_t tileCount_ = 0;
  size_t mostHeaders_ = 0;  ///< of a tile
  size_t triangleCount_ = 0;
};

}  // namespace terrane
