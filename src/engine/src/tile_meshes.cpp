#include "terrane/engine/tile_meshes.h"

#include <algorithm>
#include <utility>

#include "terrane/base/check.h"

namespace terrane {

const TileMeshes::Kept* TileMeshes::use(TileId id, int level) const {
  const auto tile = made_.find(id);
  if (tile == made_.end()) return nullptr;
  const auto at = tile->second.find(level);
  if (at == tile->second.end()) return nullptr;
  at->second.usedIn = turn_;
  return &at->second;
}

std::shared_ptr<const MeshLevel> TileMeshes::get(TileId id, int level) const {
  const Kept* kept = use(id, level);
  return kept == nullptr ? nullptr : kept->meshes;
}

const MeshLevel* TileMeshes::find(TileId id, int level) const {
  const Kept* kept = use(id, level);
  return kept == nullptr ? nullptr : kept->meshes.get();
}

void TileMeshes::add(TileId id, std::shared_ptr<const MeshLevel> meshes) {
  Kept& kept = made_[id][meshes->level];
  if (kept.meshes != nullptr) sizeBytes_ -= kept.meshes->sizeBytes();
  sizeBytes_ += meshes->sizeBytes();
  kept = {std::move(meshes), turn_};
}

void TileMeshes::drop(TileId id) {
  const auto tile = made_.find(id);
  if (tile == made_.end()) return;
  for (const auto& [level, kept] : tile->second) sizeBytes_ -= kept.meshes->sizeBytes();
  made_.erase(tile);
}

bool TileMeshes::hasMeshesBelow(TileId id) const {
  for (int quadrant = 0; quadrant < 4; ++quadrant)
    if (made_.count(id.child(quadrant)) > 0) return true;
  return false;
}

std::vector<MeshWish> TileMeshes::keepWithin(uint64_t bytes, uint64_t turns) {
  std::vector<MeshWish> out;
  while (sizeBytes_ > bytes) {
    std::vector<std::pair<uint64_t, MeshWish>> unused;
    for (const auto& [id, levels] : made_) {
      const auto& [level, kept] = *levels.rbegin();
      const bool isBefore = level == meshScale_.lastOwnLevel() && hasMeshesBelow(id);
      if (kept.usedIn + turns <= turn_ && !isBefore) unused.push_back({kept.usedIn, {id, level}});
    }
    if (unused.empty()) break;
    std::sort(unused.begin(), unused.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [usedIn, wish] : unused) {
      if (sizeBytes_ <= bytes) break;
      const auto tile = made_.find(wish.tile);
      const auto at = tile->second.find(wish.level);
      sizeBytes_ -= at->second.meshes->sizeBytes();
      tile->second.erase(at);
      if (tile->second.empty()) made_.erase(tile);
      out.push_back(wish);
    }
  }
  return out;
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
  } while (++level <= order.meshScale.lastOwnLevel() &&
           order.meshScale.layerOf(level + 2 * order.id.level) < tile.samples.layerCount);
  return out;
}

}  // namespace terrane
