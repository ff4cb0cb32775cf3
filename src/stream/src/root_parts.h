#pragma once

#include <cstdint>
#include <optional>

#include "archives.h"
#include "terrane/dataset/pmtiles_index.h"
#include "terrane/stream/tile_key.h"
#include "tile_shelf.h"

/// Over a thin line roots come in parts, and their beginnings before all else. A speed in bytes a second is
/// the line's, 0 while it is not known; where it is infinite, nothing comes in parts.
namespace terrane {

/// A line below that is thin. Of a quick line with a latency of 0.2 s manifest and directories say twice as
/// much.
inline constexpr double kThinBytesPerSecond = 32e3;

/// What of a tile is to be fetched next.
struct MissingBytes {
  PmtilesIndex::Place place;
  bool isPart = false;  ///< of a root, and not its end
};

/// All of a tile at `place` that has not come, or a part of a root that would take long.
MissingBytes missingOf(const TileKey& key, const ShelfEntry& entry, PmtilesIndex::Place place,
                       double bytesPerSecond);

/// Over a thin line, or one that is not known yet, the beginnings of the roots that are wanted in `turn` come
/// before all else: the ground's, without which nothing is seen, then those of pictures. Which of them next;
/// none: all may come.
std::optional<TileKey> nextBeginning(const Archives& archives, const TileShelf& shelf, uint64_t turn,
                                     double bytesPerSecond);

}  // namespace terrane
