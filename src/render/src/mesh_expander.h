#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/codec/compact_mesh.h"
#include "terrane/gpu/compute_program.h"
#include "terrane/gpu/storage_buffer.h"

namespace terrane {

/// Rebuilds meshes on the GPU from their compact form, by a compute shader, into the very vertices and
/// triangles that expandMeshes() gives. On the thread whose context is current; not in browsers.
class MeshExpander {
 public:
  /// A patch, and where it goes. Ranges of one call must not overlap.
  struct Job {
    /// Made by compactOf(), or one that validateCompactLevel() is content with: the GPU checks nothing. Must
    /// live until expand() returns.
    const CompactLevel* level = nullptr;
    int patch = 0;
    /// Into the vertex buffer, as PatchVertex records: compactPatch().vertexCount from here on.
    uint32_t firstVertex = 0;
    /// Into the index buffer, 32 bits an index, three for each of compactPatch().triangleCount. They count
    /// from the vertex buffer's beginning: firstVertex has been added.
    uint32_t firstIndex = 0;
    uint32_t slot = 0;  ///< below kSlots; into bits 18 to 31 of each PatchVertex::place
  };
  static constexpr uint32_t kSlots = 1U << 14;

  /// Error: the context's shaders cannot compute, or the driver refuses this one.
  static Result<MeshExpander> create(const gpu::Context& context);

  /// Writes the meshes of all jobs, of any number of tiles, with one dispatch; returns without waiting for
  /// it. Draws that follow see them. Copies the patches' words to the GPU, and allocates there only when more
  /// come than ever before. Error, and nothing is written: a job's range is not within the buffers or what a
  /// shader can see of them, or its slot is none; more words than the driver has room for.
  Status expand(const gpu::Context& context, std::span<const Job> jobs, GLuint vertexBuffer,
                GLuint indexBuffer);

 private:
  explicit MeshExpander(gpu::ComputeProgram program) : program_(std::move(program)) {}

  gpu::ComputeProgram program_;
  gpu::StorageBuffer jobs_;
  gpu::StorageBuffer compact_;
  std::vector<uint32_t> jobWords_;
  std::vector<uint32_t> compactWords_;
};

}  // namespace terrane
