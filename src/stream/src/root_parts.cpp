#include "root_parts.h"

#include <algorithm>

namespace terrane {
namespace {

/// The part of a root that comes first. So much shows mountains and coasts.
constexpr uint64_t kFirstPartBytes = 6000;
/// A part of a root should be here within this.
constexpr double kPartSeconds = 0.5;

bool hasBegun(const ShelfEntry& entry) {
  return entry.isDecoded() || entry.payload != nullptr || !entry.beginning.empty();
}

}  // namespace

MissingBytes missingOf(const TileKey& key, const ShelfEntry& entry, PmtilesIndex::Place place,
                       double bytesPerSecond) {
  MissingBytes missing{place, false};
  missing.place.offset += entry.beginning.size();
  missing.place.bytes -= static_cast<decltype(place.bytes)>(entry.beginning.size());
  if (!key.tile.isRoot() || key.isRefinement() || bytesPerSecond >= kThinBytesPerSecond) return missing;
  const uint64_t part = std::max(kFirstPartBytes, static_cast<uint64_t>(kPartSeconds * bytesPerSecond));
  missing.isPart = missing.place.bytes > part + part / 2;
  if (missing.isPart) missing.place.bytes = static_cast<decltype(place.bytes)>(part);
  return missing;
}

std::optional<TileKey> nextBeginning(const Archives& archives, const TileShelf& shelf, uint64_t turn,
                                     double bytesPerSecond) {
  if (bytesPerSecond >= kThinBytesPerSecond) return std::nullopt;
  for (const TileKey& root : archives.roots()) {
    const ShelfEntry* entry = shelf.find(root);
    if (entry != nullptr && entry->lastWanted == turn && !hasBegun(*entry) && !entry->lost &&
        archives.find(root).kind != PmtilesIndex::Kind::NotStored)
      return root;
  }
  return std::nullopt;
}

}  // namespace terrane
