#include "tile_shelf.h"

#include <algorithm>
#include <utility>

namespace terrane {

uint64_t TileShelf::bytesOf(const Tile& tile) {
  const TileSamples& samples = tile.samples;
  return sizeof(Tile) + samples.heights.size() * sizeof(float) + samples.states.size() +
         samples.layers.size() + samples.coverage.bits.size() + tile.nodes.error.size() * 5 +
         tile.nodes.largeError.size();
}

const ShelfEntry* TileShelf::find(const TileKey& key) const {
  const auto at = entries_.find(key);
  return at == entries_.end() ? nullptr : &at->second;
}
ShelfEntry* TileShelf::find(const TileKey& key) {
  const auto at = entries_.find(key);
  return at == entries_.end() ? nullptr : &at->second;
}

void TileShelf::dropPayload(ShelfEntry& entry) {
  if (entry.payload == nullptr) return;
  compressedBytes_ -= entry.payload->size();
  entry.payload.reset();
}

void TileShelf::setPayload(const TileKey& key, std::vector<uint8_t> payload, double fetchCost) {
  ShelfEntry& entry = entries_[key];
  dropPayload(entry);
  compressedBytes_ += payload.size();
  entry.keepPriority = clock_ + fetchCost / static_cast<double>(payload.size() + 1);
  entry.payload = std::make_shared<const std::vector<uint8_t>>(std::move(payload));
}

void TileShelf::setTile(TileId id, const std::shared_ptr<const Tile>& tile) {
  // note: what was forgotten while its next layer was being decoded is here again, and with that layer.
  const ShelfEntry& first = entries_[TileKey::elevation(id)];
  if (first.tile != nullptr && first.tile->samples.layerCount >= tile->samples.layerCount) return;
  if (first.tile != nullptr) dropTile(id);
  decodedBytes_ += bytesOf(*tile);
  ++decodedTiles_;
  for (int i = 0; i < tile->samples.layerCount; ++i) entries_[TileKey::elevation(id, i)].tile = tile;
  if (!id.isRoot()) ++entries_[TileKey::elevation(id.parent())].decodedChildren;
}

void TileShelf::dropTile(TileId id) {
  const std::shared_ptr<const Tile> tile = entries_[TileKey::elevation(id)].tile;
  decodedBytes_ -= bytesOf(*tile);
  --decodedTiles_;
  for (int i = 0; i < tile->samples.layerCount; ++i) entries_[TileKey::elevation(id, i)].tile.reset();
  if (!id.isRoot()) --entries_[TileKey::elevation(id.parent())].decodedChildren;
}

void TileShelf::setPicture(const TileKey& key, std::shared_ptr<const ImageryTile> picture) {
  ShelfEntry& entry = entries_[key];
  dropPicture(entry);
  pictureBytes_ += picture->rgba.size();
  entry.picture = std::move(picture);
}

void TileShelf::dropPicture(ShelfEntry& entry) {
  if (entry.picture == nullptr) return;
  pictureBytes_ -= entry.picture->rgba.size();
  entry.picture.reset();
}

void TileShelf::hold(std::span<const TileId> tiles) {
  held_.clear();
  for (TileId id : tiles) {
    while (held_.insert(id).second && !id.isRoot()) id = id.parent();
  }
}

uint64_t TileShelf::lostTiles() const {
  uint64_t lost = 0;
  for (const auto& [key, entry] : entries_) lost += entry.lost ? 1 : 0;
  return lost;
}

bool TileShelf::isBelowLost(const TileKey& key) const {
  if (!key.isElevation()) return false;
  for (TileKey layer = key;; layer = layer.before()) {
    for (TileKey need = layer;; need = need.parent()) {
      const ShelfEntry* entry = need == key ? nullptr : find(need);
      if (entry != nullptr && entry->isDecoded()) break;
      if (entry != nullptr && entry->lost) return true;
      if (need.tile.isRoot()) break;
    }
    if (!layer.isRefinement()) return false;
  }
}

void TileShelf::keepWithinBudgets(uint64_t turn) {
  // Payloads: the one that would be fetched again most cheaply for its size goes first.
  if (compressedBytes_ > budgets_.compressedBytes) {
    std::vector<ShelfEntry*> candidates;
    for (auto& [key, entry] : entries_) {
      const bool isNeeded = !entry.isDecoded() && entry.lastWanted == turn;
      if (entry.payload != nullptr && !isNeeded && !entry.decoding) candidates.push_back(&entry);
    }
    std::sort(candidates.begin(), candidates.end(),
              [](const ShelfEntry* a, const ShelfEntry* b) { return a->keepPriority < b->keepPriority; });
    for (ShelfEntry* entry : candidates) {
      if (compressedBytes_ <= budgets_.compressedBytes) break;
      clock_ = std::max(clock_, entry->keepPriority);
      dropPayload(*entry);
    }
  }

  // Decoded tiles: leaves first, round by round, since a parent becomes one when its last child goes.
  while (decodedBytes_ > budgets_.decodedBytes) {
    std::vector<std::pair<uint64_t, TileId>> candidates;
    for (const auto& [key, entry] : entries_) {
      if (entry.tile == nullptr || key.isRefinement()) continue;
      if (entry.decodedChildren > 0 || entry.lastWanted == turn) continue;
      if (!key.tile.isRoot() && held_.count(key.tile) == 0)
        candidates.emplace_back(entry.lastWanted, key.tile);
    }
    if (candidates.empty()) break;
    std::sort(candidates.begin(), candidates.end());
    for (const auto& [wanted, id] : candidates) {
      if (decodedBytes_ <= budgets_.decodedBytes) break;
      dropTile(id);
    }
  }

  if (pictureBytes_ > budgets_.pictureBytes) {
    std::vector<std::pair<uint64_t, TileKey>> candidates;
    for (const auto& [key, entry] : entries_)
      if (entry.picture != nullptr && entry.lastWanted != turn)
        candidates.emplace_back(entry.lastWanted, key);
    std::sort(candidates.begin(), candidates.end());
    for (const auto& [wanted, key] : candidates) {
      if (pictureBytes_ <= budgets_.pictureBytes) break;
      dropPicture(entries_[key]);
    }
  }

  // What nothing is known of any more needs no entry; but it does no harm for a while.
  constexpr uint64_t kTurnsBetweenSweeps = 32;
  if (turn < nextSweep_) return;
  nextSweep_ = turn + kTurnsBetweenSweeps;
  for (auto at = entries_.begin(); at != entries_.end();) {
    const ShelfEntry& entry = at->second;
    const bool isEmpty = entry.payload == nullptr && entry.beginning.empty() && !entry.isDecoded() &&
                         !entry.isSketched() && entry.request == 0 && !entry.decoding &&
                         entry.failures == 0 && entry.decodedChildren == 0 && entry.lastWanted != turn;
    at = isEmpty ? entries_.erase(at) : std::next(at);
  }
}

}  // namespace terrane
