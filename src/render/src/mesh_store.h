#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include "buddy_allocator.h"
#include "terrane/base/result.h"
#include "terrane/codec/mesh_level.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/kept_buffer.h"
#include "terrane/gpu/vertex_array.h"
#include "terrane/tiling/tile_id.h"
#include "tile_store.h"

namespace terrane {

/// Adaptive meshes of patches on the GPU: one buffer of vertices and one of indices for all of them. A patch
/// comes there when it is first drawn; what was not drawn for longest gives way. Each has a *slot*, a number
/// that its vertices carry and by which shaders find what a frame says of the patch.
class MeshStore {
 public:
  /// Where a patch's mesh is.
  struct Entry {
    std::shared_ptr<const MeshLevel> meshes;
    int index = 0;  ///< of the patch
    int slot = 0;
    uint32_t firstVertex = 0;  ///< in the vertex buffer
    uint32_t firstIndex = 0;   ///< in the index buffer
    uint64_t frame = 0;        ///< when it was last drawn

    const MeshLevel::Patch& patch() const { return meshes->patches[static_cast<size_t>(index)]; }
  };
  /// Slots that there are at most: a vertex has 14 bits for them.
  static constexpr int kMostSlots = 1 << 14;

  explicit MeshStore(gpu::Context& context);

  /// A tile's meshes of a level may be drawn from now on; they replace what was there.
  void add(TileId id, std::shared_ptr<const MeshLevel> meshes);
  /// Forgets all meshes of a tile.
  void drop(TileId id);
  bool has(TileId id, int level) const;

  /// The next frame begins: what it places stays until it ends.
  void beginFrame() { ++frame_; }
  /// Gives a patch's mesh a place on the GPU, if it has none. The place stays for this frame. Fails where
  /// there is no such mesh, or no room even without what this frame does not draw.
  Result<const Entry*> place(TileId id, int level, int index);
  /// Brings what place() found new to the GPU. Before drawing.
  void upload();

  int highestSlot() const { return slots_.highest(); }
  /// Draws from these; attributes of mesh.vert.
  void bind() const { vertexArray_.bind(); }
  /// The same attributes for another vertex array.
  void setAttributes(const gpu::VertexArray& vertexArray) const;
  const gpu::KeptBuffer& vertices() const { return vertices_; }
  const gpu::KeptBuffer& indices() const { return indices_; }
  size_t gpuBytes() const { return vertices_.sizeBytes() + indices_.sizeBytes(); }

 private:
  struct Key {
    TileId tile;
    int level = 0;
    int index = 0;
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct KeyHash {
    size_t operator()(const Key& key) const {
      return TileIdHash{}(key.tile) * 31 + static_cast<size_t>(key.level) * 8191 +
             static_cast<size_t>(key.index);
    }
  };
  Status makeBuffers();
  /// Room in one of the buffers; drops what other frames drew, then grows.
  Result<uint32_t> takeRoom(BuddyAllocator& places, uint32_t units);
  /// Drops what was not drawn for longest, some of it at least; false where all is drawn now.
  bool dropOldest();
  void releaseAll(TileId id, const MeshLevel& meshes);
  void release(const Entry& entry);

  gpu::Context& context_;
  std::unordered_map<TileId, std::map<int, std::shared_ptr<const MeshLevel>>, TileIdHash> meshes_;
  std::unordered_map<Key, Entry, KeyHash> entries_;
  LayerPool slots_;
  BuddyAllocator vertexPlaces_;
  BuddyAllocator indexPlaces_;
  gpu::KeptBuffer vertices_;
  gpu::KeptBuffer indices_;
  gpu::VertexArray vertexArray_;
  // What is to be uploaded.
  std::vector<PatchVertex> newVertices_;
  std::vector<uint32_t> newIndices_;
  std::vector<gpu::KeptBuffer::Piece> vertexPieces_;
  std::vector<gpu::KeptBuffer::Piece> indexPieces_;
  uint64_t frame_ = 0;
};

}  // namespace terrane
