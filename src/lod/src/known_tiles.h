#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "selection_context.h"
#include "terrane/codec/mesh_level.h"
#include "terrane/codec/mesh_vertices.h"
#include "terrane/codec/tile.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

/// Whether a tile, or a mesh, is here.
enum class Residency : uint8_t {
  Resident,
  Implied,  ///< not stored: an ancestor's interpolation is exact there
  Missing,
};

/// What one selection remembers of a tile.
struct KnownTile {
  TileId id;
  KnownTile* parent = nullptr;  ///< of the root: null
  std::array<KnownTile*, 4> children{};
  Residency residency = Residency::Missing;
  KnownTile* stored = nullptr;  ///< where not Missing: the tile, or for Implied its nearest stored ancestor
  const Tile* tile = nullptr;   ///< of `stored`
  uint16_t low = 65535, high = 0;  ///< for Implied, of the ancestor's quadrant
  /// Its mesh levels, as far as they were asked for.
  std::array<std::optional<const MeshLevel*>, kDeepestVertexLevel + 1> meshes{};
};

/// The tiles that one selection has come by. They hang together as the tiles do: from one to its neighbour is
/// a few steps, and each is looked up once.
class KnownTiles {
 public:
  explicit KnownTiles(const SelectionContext& context) : context_(context) { add(TileId{}, nullptr); }

  KnownTile& root() { return tiles_.front(); }
  KnownTile& childOf(KnownTile& parent, TileId id) {
    KnownTile*& child = parent.children[static_cast<size_t>(id.quadrant())];
    if (child == nullptr) child = &add(id, &parent);
    return *child;
  }
  /// A tile, by the way from another one.
  KnownTile& find(KnownTile& from, TileId id) {
    KnownTile* at = &from;
    while (at->id.level > id.level || !(id.ancestor(at->id.level) == at->id)) at = at->parent;
    while (at->id.level < id.level) at = &childOf(*at, id.ancestor(at->id.level + 1));
    return *at;
  }
  /// A stored tile's meshes of a mesh level (at most kDeepestVertexLevel), or null where they are not made.
  const MeshLevel* meshesOf(KnownTile& stored, int level) const {
    std::optional<const MeshLevel*>& meshes = stored.meshes[static_cast<size_t>(level)];
    if (!meshes) meshes = context_.resident.findMeshes(stored.id, level);
    return *meshes;
  }

 private:
  KnownTile& add(TileId id, KnownTile* parent);
  bool mayDraw(const Tile& tile, const KnownTile* parent) const;

  const SelectionContext& context_;
  std::deque<KnownTile> tiles_;  ///< note: they point at each other, and so may never move
};

}  // namespace terrane
