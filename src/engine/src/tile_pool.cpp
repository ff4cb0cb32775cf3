#include "terrane/engine/tile_pool.h"

#include <algorithm>
#include <optional>

#include "terrane/base/check.h"
#include "terrane/base/parallel.h"
#include "terrane/codec/all_layers.h"
#include "terrane/codec/elevation_codec.h"

namespace terrane {

namespace {

/// Tiles whose bytes are in memory at once.
constexpr size_t kReadTogether = 256;

}  // namespace

const Tile* TilePool::find(TileId id) const {
  const auto at = stored_.find(id);
  return at == stored_.end() ? nullptr : at->second.get();
}

Status TilePool::load(std::span<const TileId> ids) {
  std::vector<TileId> missing;
  for (const TileId id : ids)
    if (find(id) == nullptr) missing.push_back(id);
  for (size_t i = 0; i < missing.size(); i += kReadTogether)
    TERRANE_TRY(loadMissing(std::span(missing).subspan(i, std::min(kReadTogether, missing.size() - i))));
  return {};
}

Status TilePool::loadMissing(std::span<const TileId> missing) {
  TERRANE_ASSIGN(const auto payloads, dataset_.readAllLayers(missing));

  // Decode side by side: tiles of one call do not depend on each other, their parents are here.
  std::vector<std::optional<Result<Tile>>> decoded(missing.size());
  parallelFor(static_cast<int64_t>(missing.size()), 0, [&](int64_t index) {
    const auto i = static_cast<size_t>(index);
    const TileId id = missing[i];
    const Tile* parent = id.isRoot() ? nullptr : find(id.parent());
    TERRANE_CHECK(id.isRoot() || parent != nullptr, "tile {} before its parent", toString(id));
    if (!payloads[i]) {
      decoded[i] = Result<Tile>(makeError("is missing from the elevation archive; build the dataset again"));
    } else {
      decoded[i] = decodeAllLayers(*payloads[i], parent != nullptr ? &parent->samples : nullptr,
                                   id.isRoot() ? 0 : id.quadrant(), dataset_.manifest().scale);
    }
  });

  for (size_t i = 0; i < missing.size(); ++i) {
    if (!decoded[i]->ok())
      return makeError("{}: tile {}: {}", dataset_.directory(), toString(missing[i]),
                       decoded[i]->error().message);
    for (const auto& payload : *payloads[i]) bytesRead_ += payload.size();
    stored_[missing[i]] = std::make_unique<Tile>(std::move(**decoded[i]));
  }
  return {};
}

const Tile& TilePool::findOrImply(TileId id) {
  if (const Tile* tile = find(id)) return *tile;
  if (const auto at = implied_.find(id); at != implied_.end()) return *at->second;
  TERRANE_CHECK(!id.isRoot(), "nothing is resident");
  const Tile& parent = findOrImply(id.parent());
  auto made = std::make_unique<Tile>(interpolateTile(parent, id.quadrant()));
  return *(implied_[id] = std::move(made));
}

uint64_t TilePool::residentBytes() const {
  const uint64_t layerBytes = dataset_.manifest().scale.layerCount > 1 ? 1 : 0;
  const uint64_t perTile =
      kTileSampleCount * (sizeof(float) + sizeof(SampleState) + layerBytes) + sizeof(Tile);
  return (stored_.size() + implied_.size()) * perTile + meshes_.sizeBytes();
}

void TilePool::makeMeshes(std::span<const MeshWish> wishes) {
  std::vector<TileMeshes::Order> orders;
  for (const MeshWish& wish : wishes) orders.push_back(meshes_.orderFor(wish));
  std::vector<std::vector<std::shared_ptr<const MeshLevel>>> made(orders.size());
  parallelFor(static_cast<int64_t>(orders.size()), 0, [&](int64_t index) {
    const auto i = static_cast<size_t>(index);
    made[i] = TileMeshes::make(orders[i], *find(orders[i].id));
  });
  for (size_t i = 0; i < orders.size(); ++i)
    for (auto& meshes : made[i]) meshes_.add(orders[i].id, std::move(meshes));
}

void TilePool::clear() {
  stored_.clear();
  implied_.clear();
  meshes_.clear();
}

}  // namespace terrane
