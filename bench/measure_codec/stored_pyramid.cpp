#include "stored_pyramid.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "terrane/codec/all_layers.h"
#include "terrane/codec/elevation_codec.h"

namespace terrane {
namespace {

uint64_t bytesOf(const TilePayloads& payloads) {
  uint64_t sum = 0;
  for (const auto& payload : payloads) sum += payload.size();
  return sum;
}

}  // namespace

Result<StoredPyramid> StoredPyramid::open(const std::string& directory) {
  TERRANE_ASSIGN(const Dataset dataset, Dataset::open(directory));
  StoredPyramid pyramid(dataset.manifest());
  std::vector<TileId> ids = dataset.elevationTiles();
  std::sort(ids.begin(), ids.end());
  std::unordered_map<TileId, size_t, TileIdHash> places;
  for (const TileId id : ids) {
    TERRANE_ASSIGN(auto payloads, dataset.readAllLayers(id));
    if (!payloads) return makeError("{}: tile {} is listed and not there", directory, toString(id));
    const size_t place = pyramid.tiles_.size();
    places[id] = place;
    pyramid.tiles_.push_back({id, std::move(*payloads)});
    if (id.isRoot()) continue;
    const auto parent = places.find(id.parent());
    if (parent == places.end()) return makeError("{}: tile {} has no parent", directory, toString(id));
    pyramid.tiles_[parent->second].children[static_cast<size_t>(id.quadrant())] = static_cast<int>(place);
  }
  if (pyramid.tiles_.empty()) return makeError("{}: holds no tiles", directory);
  return pyramid;
}

uint64_t StoredPyramid::bytes() const {
  uint64_t sum = 0;
  for (const StoredTile& tile : tiles_) sum += bytesOf(tile.payloads);
  return sum;
}

uint64_t StoredPyramid::finestBytes() const {
  uint64_t sum = 0;
  for (const StoredTile& tile : tiles_) {
    if (tile.id.level == manifest_.frame.finestLevel) sum += bytesOf(tile.payloads);
  }
  return sum;
}

int64_t StoredPyramid::finestTiles() const {
  return std::count_if(tiles_.begin(), tiles_.end(),
                       [&](const StoredTile& tile) { return tile.id.level == manifest_.frame.finestLevel; });
}

Status StoredPyramid::decodeAll(const UseTile& use) const {
  std::vector<Tile> unused;
  return decodeBelow(tiles_.front(), nullptr, use, unused);
}

Status StoredPyramid::decodeAll() const {
  return decodeAll([](TileId, const Tile&) { return Status(); });
}

Status StoredPyramid::decodeBelow(const StoredTile& stored, const TileSamples* parent, const UseTile& use,
                                  std::vector<Tile>& unused) const {
  const int quadrant = parent == nullptr ? 0 : stored.id.quadrant();
  Tile recycled;
  if (!unused.empty()) {
    recycled = std::move(unused.back());
    unused.pop_back();
  }
  TERRANE_ASSIGN(Tile tile,
                 decodeAllLayers(stored.payloads, parent, quadrant, manifest_.scale, std::move(recycled)));
  TERRANE_TRY(use(stored.id, tile));
  for (const int child : stored.children) {
    if (child >= 0) TERRANE_TRY(decodeBelow(tiles_[static_cast<size_t>(child)], &tile.samples, use, unused));
  }
  unused.push_back(std::move(tile));
  return {};
}

/// Goes down to the wanted tiles, through what is stored and what is interpolated.
class StoredPyramid::FinestVisit {
 public:
  FinestVisit(const StoredPyramid& pyramid, std::span<const TileId> finest, const UseTile& use)
      : pyramid_(pyramid), use_(use) {
    for (const TileId tile : finest) {
      for (TileId id = tile; !id.isRoot(); id = id.parent()) touched_.insert(id);
    }
  }

  Status run() {
    const StoredTile& root = pyramid_.tiles_.front();
    TERRANE_ASSIGN(const Tile tile, decodeAllLayers(root.payloads, nullptr, 0, pyramid_.manifest_.scale));
    return visit(root.id, &root, tile);
  }

 private:
  Status visit(TileId id, const StoredTile* stored, const Tile& tile) {
    if (id.level == pyramid_.manifest_.frame.finestLevel) return use_(id, tile);
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      const TileId child = id.child(quadrant);
      if (touched_.count(child) == 0) continue;
      const int place = stored == nullptr ? -1 : stored->children[static_cast<size_t>(quadrant)];
      if (place < 0) {
        TERRANE_TRY(visit(child, nullptr, interpolateTile(tile, quadrant)));
        continue;
      }
      const StoredTile& next = pyramid_.tiles_[static_cast<size_t>(place)];
      TERRANE_ASSIGN(const Tile decoded,
                     decodeAllLayers(next.payloads, &tile.samples, quadrant, pyramid_.manifest_.scale));
      TERRANE_TRY(visit(child, &next, decoded));
    }
    return {};
  }

  const StoredPyramid& pyramid_;
  const UseTile& use_;
  std::unordered_set<TileId, TileIdHash> touched_;
};

Status StoredPyramid::visitFinest(std::span<const TileId> finest, const UseTile& use) const {
  return FinestVisit(*this, finest, use).run();
}

}  // namespace terrane
