#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "terrane/codec/imagery_codec.h"
#include "terrane/codec/tile.h"
#include "terrane/stream/tile_key.h"

namespace terrane {

/// What is known of one tile.
struct ShelfEntry {
  std::shared_ptr<const std::vector<uint8_t>> payload;  ///< as it came
  /// Decoded, elevation: with all layers of significance that are here, so one for this layer and others.
  std::shared_ptr<const Tile> tile;
  std::shared_ptr<const ImageryTile> picture;        ///< decoded, imagery
  std::vector<uint8_t> beginning;                    ///< of a root's payload, while the rest is to come
  std::shared_ptr<const Tile> sketch;                ///< from that beginning
  std::shared_ptr<const ImageryTile> pictureSketch;  ///< likewise
  uint64_t request = 0;                              ///< that will bring it; 0: none
  bool decoding = false;
  bool alone = false;         ///< to be fetched by itself: a request with others failed
  bool fresh = false;         ///< to be fetched past caches: it was damaged
  int failures = 0;           ///< in a row
  int damages = 0;            ///< of these, damaged answers
  double notBefore = 0.0;     ///< seconds: the next try
  bool lost = false;          ///< given up, at least until notBefore
  int decodedChildren = 0;    ///< of an elevation's first layer
  uint64_t lastWanted = 0;    ///< turn
  double wantedSince = 0.0;   ///< seconds, without a turn in between
  double keepPriority = 0.0;  ///< of the payload, GreedyDual-Size

  bool isDecoded() const { return tile != nullptr || picture != nullptr; }
  bool isSketched() const { return sketch != nullptr || pictureSketch != nullptr; }
};

/// The tiles that are here, compressed and decoded, within budgets.
class TileShelf {
 public:
  struct Budgets {
    uint64_t compressedBytes = 0;
    uint64_t decodedBytes = 0;
    uint64_t pictureBytes = 0;
  };
  explicit TileShelf(const Budgets& budgets) : budgets_(budgets) {}

  const ShelfEntry* find(const TileKey& key) const;
  ShelfEntry* find(const TileKey& key);
  ShelfEntry& at(const TileKey& key) { return entries_[key]; }

  /// `fetchCost`: what fetching it again would take, in bytes of line time.
  void setPayload(const TileKey& key, std::vector<uint8_t> payload, double fetchCost);
  void dropPayload(ShelfEntry& entry);
  /// An elevation tile with some of its layers of significance: it takes the place of what is here with
  /// fewer, so that all layers share the one with most.
  void setTile(TileId id, const std::shared_ptr<const Tile>& tile);
  void setPicture(const TileKey& key, std::shared_ptr<const ImageryTile> picture);

  /// Elevation tiles that stay, with their ancestors.
  void hold(std::span<const TileId> tiles);
  /// Forgets what is over the budgets: payloads of the least priority; of decoded tiles those that were not
  /// wanted for the longest time, never one that is held, whose child is decoded, or that was wanted in
  /// `turn`. Whoever wants a layer of a tile wants those before it; a tile goes with all its layers.
  void keepWithinBudgets(uint64_t turn);

  uint64_t compressedBytes() const { return compressedBytes_; }
  uint64_t decodedBytes() const { return decodedBytes_; }
  uint64_t decodedTiles() const { return decodedTiles_; }
  uint64_t pictureBytes() const { return pictureBytes_; }
  /// Is there room for what may be needed later, or at least for what is needed now while `decoding` others
  /// are being decoded? Two more than the budget may wait for a place on the GPU.
  bool hasRoomToDecode(bool isUrgent, int decoding) const {
    if (!isUrgent) return decodedBytes_ < budgets_.decodedBytes / 10 * 9;
    return decodedBytes_ + static_cast<uint64_t>(decoding) * kTypicalTileBytes <
           budgets_.decodedBytes + kTypicalTileBytes;
  }
  uint64_t lostTiles() const;
  /// Is one of the tiles that it needs given up: an ancestor, or what it refines? Then it cannot be decoded.
  bool isBelowLost(const TileKey& key) const;
  const std::unordered_map<TileKey, ShelfEntry, TileKeyHash>& entries() const { return entries_; }

  static uint64_t bytesOf(const Tile& tile);

 private:
  static constexpr uint64_t kTypicalTileBytes = 340000;

  void dropTile(TileId id);
  void dropPicture(ShelfEntry& entry);

  Budgets budgets_;
  std::unordered_map<TileKey, ShelfEntry, TileKeyHash> entries_;
  std::unordered_set<TileId, TileIdHash> held_;
  uint64_t nextSweep_ = 0;  ///< the turn in which entries without anything go
  double clock_ = 0.0;      ///< priority of the last payload that was forgotten
  uint64_t compressedBytes_ = 0;
  uint64_t decodedBytes_ = 0;
  uint64_t decodedTiles_ = 0;
  uint64_t pictureBytes_ = 0;
};

}  // namespace terrane
