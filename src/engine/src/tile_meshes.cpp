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
  std::shared_ptr<const MeshLevel>& kept = made_[id][meshes->level];
  if (kept != nullptr) sizeBytes_ -= kept->sizeBytes();
  sizeBytes_ += meshes->sizeBytes();
  kept = std::move(meshes);
}

void TileMeshes::drop(TileId id) {
  const auto tile = made_.find(id);
  if (tile == made_.end()) return;
  for (const auto& [level, meshes] : tile->second) sizeBytes_ -= meshes->sizeBytes();
  made_.erase(tile);
}

void TileMeshes::clear() {
  made_.clear();
  sizeBytes_ = 0;
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
