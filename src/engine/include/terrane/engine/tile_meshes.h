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
  size_t sizeBytes() const { return sizeBytes_; }

  /// What answers a wish: the wished level and, of a tile's own levels, those after it, which will be wished
  /// next. A pure function, any thread; some milliseconds. The level before must be made.
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
  MeshScale meshScale_;
  ElevationScale scale_;
  std::unordered_map<TileId, std::map<int, std::shared_ptr<const MeshLevel>>, TileIdHash> made_;
  size_t sizeBytes_ = 0;
};

}  // namespace terrane
