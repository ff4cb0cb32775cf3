#include "known_tiles.h"

namespace terrane {

KnownTile& KnownTiles::add(TileId id, KnownTile* parent) {
  KnownTile& added = tiles_.emplace_back();
  added.id = id;
  added.parent = parent;
  if (const Tile* tile = context_.resident.find(id); tile != nullptr && mayDraw(*tile, parent)) {
    added.residency = Residency::Resident;
    added.tile = tile;
    added.stored = &added;
  } else if (parent != nullptr && parent->residency == Residency::Implied) {
    added.residency = Residency::Implied;
    added.low = parent->low;
    added.high = parent->high;
  } else if (parent != nullptr && parent->residency == Residency::Resident) {
    const ChildSummary& child = parent->tile->children[static_cast<size_t>(id.quadrant())];
    if (child.state != ChildState::Present) {
      added.residency = Residency::Implied;
      added.low = child.low;
      added.high = child.high;
    }
  }
  if (added.residency == Residency::Implied) {
    added.tile = parent->tile;
    added.stored = parent->stored;
  }
  return added;
}

/// Patches draw all of a tile's samples, so they want all layers, of the tile and those above it, or
/// neighbours would not meet. note: a root is better than nothing, and alone it meets with itself.
bool KnownTiles::mayDraw(const Tile& tile, const KnownTile* parent) const {
  if (context_.isMeshes || parent == nullptr) return true;
  return context_.isWhole(tile) &&
         (parent->residency != Residency::Resident || context_.isWhole(*parent->tile));
}

}  // namespace terrane
