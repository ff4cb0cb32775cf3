#include "terrane/engine/tile_meshes.h"

#include <utility>

#include "terrane/base/check.h"

namespace terrane {

std::shared_ptr<const MeshLevel> TileMeshes::get(TileId id, int level) const {
  const auto tile = made_.find(id);
  if (tile == made_.end()) return nullptr;
  const auto at = tile->second.find(level);
  return at == tile->second.end() ? nullptr : at->second;
}

const MeshLevel* TileMeshes::find(TileId id, int level) const {
  const auto tile = made_.find(id);
  if (tile == made_.end()) return nullptr;
  const auto at = tile->second.find(level);
  return at == tile->second.end() ? nullptr : at->second.get();
}

void TileMeshes::add(TileId id, std::shared_ptr<const MeshLevel> meshes) {
  const int level = meshes->level;
  made_[id][level] = std::move(meshes);
}

size_t TileMeshes::sizeBytes() const {
  size_t out = 0;
  for (const auto& [id, levels] : made_)
    for (const auto& [level, meshes] : levels) out += meshes->sizeBytes();
  return out;
}

TileMeshes::Order TileMeshes::orderFor(const MeshWish& wish) const {
  Order out{wish.tile, wish.level, nullptr, meshScale_, scale_};
  if (wish.level > meshScale_.firstLevel(wish.tile.isRoot()))
    out.before = get(wish.tile, wish.level - 1);
  else if (!wish.tile.isRoot())
    out.before = get(wish.tile.parent(), meshScale_.lastOwnLevel());
  TERRANE_CHECK(out.before != nullptr || (wish.tile.isRoot() && wish.level == 0),
                "mesh level {} of tile {} before the one above it", wish.level, toString(wish.tile));
  return out;
}

std::vector<std::shared_ptr<const MeshLevel>> TileMeshes::make(const Order& order, const Tile& tile) {
  std::vector<std::shared_ptr<const MeshLevel>> out;
  const MeshLevel* before = order.before.get();
  int level = order.level;
  do {
    out.push_back(std::make_shared<const MeshLevel>(
        makeMeshLevel(order.id, tile, level, before, order.meshScale, order.scale)));
    before = out.back().get();
  } while (++level <= order.meshScale.lastOwnLevel());
  return out;
}

}  // namespace terrane
