#pragma once

#include <cstdint>
#include <map>

#include "terrane/base/result.h"
#include "terrane/codec/mesh_level.h"
#include "terrane/dataset/dataset.h"
#include "terrane/lod/cut.h"

namespace terrane {

/// The tiles, and of each the mesh levels, that cuts are drawn from, with what these are made of: ancestors
/// and the levels before.
class UsedTiles {
 public:
  explicit UsedTiles(const MeshScale& meshScale) : meshScale_(meshScale) {}
  void add(const Cut& cut);
  /// Tiles, parents before children, and their deepest mesh level; -1: none.
  const std::map<TileId, int>& deepestMeshLevels() const { return deepest_; }

 private:
  void addTile(TileId id);
  void addMeshes(TileId id, int level);

  MeshScale meshScale_;
  std::map<TileId, int> deepest_;
};

/// What workers do for a flight, done again in one thread.
struct TileWork {
  int64_t tiles = 0;
  double decodeSeconds = 0.0;  ///< CPU time of decoding elevation
  int64_t meshLevels = 0;
  double meshSeconds = 0.0;  ///< CPU time of making meshes
  int64_t meshTriangles = 0;
  uint64_t meshBytes = 0;
};
/// Errors: tiles that cannot be read or decoded.
Result<TileWork> doTileWork(const Dataset& dataset, const UsedTiles& used);

}  // namespace terrane
