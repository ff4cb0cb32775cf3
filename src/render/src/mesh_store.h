#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/mesh_level.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/kept_buffer.h"
#include "terrane/gpu/vertex_array.h"
#include "terrane/tiling/tile_id.h"
#include "tile_store.h"

namespace terrane {

/// Adaptive meshes of patches on the GPU: one buffer of vertices and one of indices for all of them. A patch
/// comes there when it is first drawn. What comes in one frame is written side by side, by one upload a
/// buffer, around and around: it takes the places of what came longest ago, and what of that is still drawn
/// comes anew. Each has a *slot*, a number that its vertices carry and by which shaders find what a frame
/// says of the patch.
class MeshStore {
 public:
  /// Where a patch's mesh is.
  struct Entry {
    std::shared_ptr<const MeshLevel> meshes;
    int index = 0;  ///< of the patch
    int slot = -1;
    uint32_t firstVertex = 0;  ///< in the vertex buffer
    uint32_t firstIndex = 0;   ///< in the index buffer
    uint64_t serial = 0;       ///< of what was written there; 0: nothing yet
    uint64_t frame = 0;        ///< when it was last drawn

    const MeshLevel::Patch& patch() const { return meshes->patches[static_cast<size_t>(index)]; }
  };
  /// Slots that there are at most: a vertex has 14 bits for them.
  static constexpr int kMostSlots = 1 << 14;

  /// Room at first, in vertices and indices: 28 MB, what a frame draws several times over, so that little of
  /// it is written again. It grows where that is too little.
  struct Room {
    uint32_t vertices = 1U << 20;
    uint32_t indices = 1U << 22;
  };
  explicit MeshStore(gpu::Context& context) : MeshStore(context, Room()) {}
  MeshStore(gpu::Context& context, const Room& room);

  /// A tile's meshes of a level may be drawn from now on; they replace what was there.
  void add(TileId id, std::shared_ptr<const MeshLevel> meshes);
  /// Forgets all meshes of a tile.
  void drop(TileId id);
  /// Forgets those of one level.
  void drop(TileId id, int level);
  bool has(TileId id, int level) const;

  /// The next frame begins: what it places stays until it ends.
  void beginFrame();
  /// Draws a patch's mesh in this frame. Where it is, and in which slot, upload() tells; the entry stays for
  /// this frame. Fails where there is no such mesh.
  Result<const Entry*> place(TileId id, int level, int index);
  /// Brings what is drawn in this frame to the GPU, if it is not there. Fails where there is no room for it.
  Status upload();

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
  /// What was written, in the order of its places: the oldest first. Another serial: it is there no more.
  struct Written {
    Key key;
    uint64_t serial = 0;
    uint64_t firstVertex = 0;  ///< counted on from around to around
    uint64_t firstIndex = 0;
  };
  /// A tile's meshes of one level, and which of them have entries.
  struct Level {
    std::shared_ptr<const MeshLevel> meshes;
    std::vector<Entry*> entries;  ///< by patch; null: none
  };
  Level* find(TileId id, int level);
  void forget(const Key& key);
  Status makeBuffers();
  bool hasRoom() const;
  bool freeOldest();
  void releaseAll(TileId id, const MeshLevel& meshes);
  void release(const Entry& entry);
  void arrive(const Key& key, Entry& entry);
  void forgetArriving();

  gpu::Context& context_;
  std::unordered_map<TileId, std::map<int, Level>, TileIdHash> meshes_;
  Level* last_ = nullptr;  ///< what find() gave last, for these two
  TileId lastTile_;
  int lastLevel_ = 0;
  std::unordered_map<Key, Entry, KeyHash> entries_;
  LayerPool slots_;
  gpu::KeptBuffer vertices_;
  gpu::KeptBuffer indices_;
  gpu::VertexArray vertexArray_;
  uint32_t vertexUnits_;
  uint32_t indexUnits_;
  std::deque<Written> written_;
  uint64_t nextVertex_ = 0, nextIndex_ = 0;  ///< where the next is written, counted on
  uint64_t lastSerial_ = 0;
  // What upload() has to write, and how much it is.
  std::vector<std::pair<Key, Entry*>> arriving_;
  uint64_t arrivingVertices_ = 0, arrivingIndices_ = 0;
  std::vector<PatchVertex> newVertices_;
  std::vector<uint32_t> newIndices_;
  uint64_t frame_ = 0;
};

}  // namespace terrane
