#include "terrane/engine/tile_pool.h"

#include <optional>

#include "terrane/base/check.h"
#include "terrane/base/parallel.h"
#include "terrane/codec/elevation_codec.h"

namespace terrane {

const Tile* TilePool::find(TileId id) const {
  const auto at = stored_.find(id);
  return at == stored_.end() ? nullptr : at->second.get();
}

Status TilePool::load(std::span<const TileId> ids) {
  std::vector<TileId> missing;
  for (const TileId id : ids)
    if (find(id) == nullptr) missing.push_back(id);

  // Decode side by side: tiles of one call do not depend on each other, their parents are here.
  std::vector<std::optional<Result<Tile>>> decoded(missing.size());
  std::vector<uint64_t> bytes(missing.size());
  parallelFor(static_cast<int64_t>(missing.size()), 0, [&](int64_t index) {
    const auto i = static_cast<size_t>(index);
    const TileId id = missing[i];
    const Tile* parent = id.isRoot() ? nullptr : find(id.parent());
    TERRANE_CHECK(id.isRoot() || parent != nullptr, "tile {} before its parent", toString(id));
    auto payload = dataset_.readElevation(id);
    if (!payload.ok()) {
      decoded[i] = Result<Tile>(payload.error());
    } else if (!payload->has_value()) {
      decoded[i] =
          Result<Tile>(makeError("{}: tile {} is missing from the elevation archive; build the dataset again",
                                 dataset_.directory(), toString(id)));
    } else {
      bytes[i] = (*payload)->size();
      decoded[i] = decodeTile(**payload, parent != nullptr ? &parent->samples : nullptr,
                              id.isRoot() ? 0 : id.quadrant(), dataset_.manifest().scale);
    }
  });

  for (size_t i = 0; i < missing.size(); ++i) {
    if (!decoded[i]->ok())
      return makeError("{}: tile {}: {}", dataset_.directory(), toString(missing[i]),
                       decoded[i]->error().message);
    bytesRead_ += bytes[i];
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
  const uint64_t perTile = kTileSampleCount * (sizeof(float) + sizeof(SampleState)) + sizeof(Tile);
  return (stored_.size() + implied_.size()) * perTile;
}

void TilePool::clear() {
  stored_.clear();
  implied_.clear();
}

}  // namespace terrane
