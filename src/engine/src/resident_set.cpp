#include "resident_set.h"

#include <algorithm>

#include "terrane/base/check.h"

namespace terrane {

void ResidentSet::add(TileId id, uint64_t frame) {
  TERRANE_CHECK(!isFull(), "{} tiles in {} places", tiles_.size(), capacity_);
  tiles_[id].lastNeeded = frame;
  if (id.isRoot()) return;
  if (const auto parent = tiles_.find(id.parent()); parent != tiles_.end()) ++parent->second.children;
}

void ResidentSet::remove(TileId id) {
  if (tiles_.erase(id) == 0 || id.isRoot()) return;
  if (const auto parent = tiles_.find(id.parent()); parent != tiles_.end()) --parent->second.children;
}

void ResidentSet::need(TileId id, uint64_t frame) {
  for (;; id = id.parent()) {
    if (const auto at = tiles_.find(id); at != tiles_.end()) {
      // Whoever was marked has marked its ancestors.
      if (at->second.lastNeeded == frame) return;
      at->second.lastNeeded = frame;
    }
    if (id.isRoot()) return;
  }
}

std::optional<TileId> ResidentSet::victim(uint64_t frame) const {
  const std::pair<const TileId, Entry>* oldest = nullptr;
  for (const auto& entry : tiles_) {
    if (entry.second.children > 0 || entry.second.lastNeeded >= frame || entry.first.isRoot()) continue;
    // note: by address among equals, so that the same is dropped in every run.
    if (oldest == nullptr || entry.second.lastNeeded < oldest->second.lastNeeded ||
        (entry.second.lastNeeded == oldest->second.lastNeeded && oldest->first < entry.first))
      oldest = &entry;
  }
  return oldest == nullptr ? std::nullopt : std::optional<TileId>(oldest->first);
}

size_t ResidentSet::neededSince(uint64_t frame) const {
  return static_cast<size_t>(std::count_if(tiles_.begin(), tiles_.end(), [frame](const auto& entry) {
    return entry.second.lastNeeded >= frame;
  }));
}

}  // namespace terrane
