#pragma once

#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include "terrane/codec/mesh_level.h"
#include "terrane/lod/cut.h"

namespace terrane {

/// The mesh levels of tiles that are made. One thread.
class TileMeshes {
 public:
  TileMeshes(const Frame& frame, const ElevationScale& scale)
      : meshScale_(MeshScale::of(frame, scale)), scale_(scale) {}

  /// Null where it is not made.
  std::shared_ptr<const MeshLevel> get(TileId id, int level) const;
  const MeshLevel* find(TileId id, int level) const;
  void add(TileId id, std::shared_ptr<const MeshLevel> meshes);
  void drop(TileId id);
  void clear();

  /// A selection begins: what is found from now on counts as used in it.
  void beginTurn() { ++turn_; }
  /// Forgets meshes until they take no more than `bytes`, those first that were used the longest time ago: of
  /// a tile the deepest level, if no child's meshes were made from it. Keeps what was used in the last
  /// `turns` turns, whatever it takes. Returns what it forgot.
  std::vector<MeshWish> keepWithin(uint64_t bytes, uint64_t turns);
  size_t sizeBytes() const { return sizeBytes_; }

  /// What answers a wish: the wished level and, of a tile's own levels, those after it, which will be wished
  /// next, as far as the tile has the layers that they are made of. A pure function, any thread; some
  /// milliseconds. The level before must be made.
  struct Order {
    TileId id;
    int level = 0;
    std::shared_ptr<const MeshLevel> before;  ///< null for the world's first
    MeshScale meshScale;
    ElevationScale scale;
  };
  Order orderFor(const MeshWish& wish) const;
  static std::vector<std::shared_ptr<const MeshLevel>> make(const Order& order, const Tile& tile);

 private:
  struct Kept {
    std::shared_ptr<const MeshLevel> meshes;
    mutable uint64_t usedIn = 0;  ///< turn
  };
  bool hasMeshesBelow(TileId id) const;
  const Kept* use(TileId id, int level) const;

  MeshScale meshScale_;
  ElevationScale scale_;
  std::unordered_map<TileId, std::map<int, Kept>, TileIdHash> made_;
  uint64_t turn_ = 0;
  size_t sizeBytes_ = 0;
};

}  // namespace terrane
