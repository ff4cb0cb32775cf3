#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "archives.h"
#include "terrane/dataset/pmtiles_index.h"
#include "terrane/stream/tile_key.h"
#include "tile_shelf.h"

namespace terrane {

/// Groups are the tiles so many levels below one tile, which lie together in the archive. Where enough of a
/// group is here or wanted, the rest of it may come along: it will most likely be wanted next, and by itself
/// each tile would take a request.
class TileGroups {
 public:
  /// A tile that may come along, and where its bytes are.
  struct Companion {
    TileKey key;
    PmtilesIndex::Place place;
  };

  /// Both must outlive this.
  TileGroups(const Archives& archives, const TileShelf& shelf) : archives_(archives), shelf_(shelf) {}

  /// What may come along with tiles that are about to be fetched. `turn`: what was wanted in it will come
  /// anyway. `bytesPerSecond`: of the line; the quicker it is, the larger are groups.
  std::vector<Companion> companionsOf(std::span<const TileKey> fetched, uint64_t turn, double bytesPerSecond);

 private:
  /// The tiles `levels` below `top`.
  struct Group {
    TileKey top;
    int levels = 0;
    friend bool operator==(const Group&, const Group&) = default;
    friend auto operator<=>(const Group&, const Group&) = default;
  };

  static std::vector<TileKey> tilesOf(const Group& group);
  Group groupAround(Group group, double mostBytes);
  double bytesOf(const Group& group);

  const Archives& archives_;
  const TileShelf& shelf_;
  std::map<Group, double> bytes_;  ///< what bytesOf() has found
};

}  // namespace terrane
