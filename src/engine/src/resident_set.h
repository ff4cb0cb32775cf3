#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>

#include "terrane/tiling/tile_id.h"

namespace terrane {

/// Which tiles have one of a fixed number of places. A tile's parent has one, too, if the set was filled
/// that way: victim() never names a tile with a child.
class ResidentSet {
 public:
  explicit ResidentSet(size_t capacity = 0) : capacity_(capacity) {}

  size_t capacity() const { return capacity_; }
  size_t size() const { return tiles_.size(); }
  bool isFull() const { return tiles_.size() >= capacity_; }
  bool has(TileId id) const { return tiles_.count(id) != 0; }
  void add(TileId id, uint64_t frame);
  void remove(TileId id);
  /// Marks a tile and its ancestors as needed in a frame. Those that have no place are passed over.
  void need(TileId id, uint64_t frame);
  /// The tile without children that was needed least recently, before `frame`; never the root.
  std::optional<TileId> victim(uint64_t frame) const;
  /// Tiles that were needed in a frame or later.
  size_t neededSince(uint64_t frame) const;

 private:
  struct Entry {
    uint64_t lastNeeded = 0;
    int children = 0;
  };
  size_t capacity_;
  std::unordered_map<TileId, Entry, TileIdHash> tiles_;
};

}  // namespace terrane
