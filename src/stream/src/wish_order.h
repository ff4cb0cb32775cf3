#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "archives.h"
#include "terrane/stream/tile_key.h"
#include "terrane/stream/tile_stream.h"
#include "tile_shelf.h"

namespace terrane {

/// Bytes on the line that a request takes besides its answer's body.
inline constexpr double kRequestBytes = 500.0;

/// A wished tile, or one that it needs.
struct RankedTile {
  TileKey key;
  double worthPerByte = 0.0;  ///< of the wish
  bool isUrgent = true;       ///< of use now; else only perhaps, later
  double chance = 1.0;        ///< the wish's
  double excess = 1.0;        ///< of the wish: its error now, in targets
};

/// What is wished for, in the order of what it is worth a byte, each tile behind those that it needs.
class WishOrder {
 public:
  /// Both must outlive this. `inOrder`: the wishes keep the order in which they are given.
  WishOrder(const Archives& archives, TileShelf& shelf, bool inOrder)
      : archives_(archives), shelf_(shelf), inOrder_(inOrder) {}

  /// Begins a turn with other wishes. Entries of what is wanted, wished for or needed, say so from now on,
  /// and since when. `looseness`: what targets are multiplied by.
  void replace(std::span<const StreamWish> wishes, double looseness, double nowSeconds);

  /// Each tile once.
  std::span<const RankedTile> ranked() const { return ranked_; }
  /// Counts calls of replace().
  uint64_t turn() const { return turn_; }
  bool isWanted(const ShelfEntry& entry) const { return entry.lastWanted == turn_; }

  /// The part of the wishes that the picture misses now: pixels of error above target, times the pixels that
  /// have them.
  double debt() const;
  /// Of the wishes that are of use now, what has not come.
  uint64_t wishedBytes() const;
  /// Ranked tiles that are neither decoded nor given up.
  uint64_t missingTiles() const;
  /// Is there one among them that can still come?
  bool canMoreCome() const;

 private:
  uint64_t storedBytes(const TileKey& key) const;
  bool isHereOrLost(const TileKey& key) const;
  void rankWithNeeds(const RankedTile& ranked, double nowSeconds);

  const Archives& archives_;
  TileShelf& shelf_;
  bool inOrder_;
  uint64_t turn_ = 0;
  std::vector<StreamWish> wishes_;
  std::vector<RankedTile> ranked_;
};

}  // namespace terrane
