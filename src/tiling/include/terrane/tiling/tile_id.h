#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace terrane {

/// Samples along the side of a tile; neighbouring tiles share their border samples.
inline constexpr int kTileSamples = 257;
/// Cells (sample intervals) along the side of a tile.
inline constexpr int kTileCells = kTileSamples - 1;
inline constexpr int kTileSampleCount = kTileSamples * kTileSamples;
inline constexpr int kTileCellCount = kTileCells * kTileCells;

/// The deepest level an address can have. 256 * 2^21 cells a side keep every lattice coordinate, and the
/// difference of any two, within 32 bits.
inline constexpr int kMaxLevel = 21;

/// The address of a tile: quadtree level (0 is the one root tile, which covers the world), column from the
/// west and row from the north, both below 2^level. A plain value; ordered by level, row, column.
struct TileId {
  int32_t level = 0;
  int32_t col = 0;
  int32_t row = 0;

  friend bool operator==(const TileId&, const TileId&) = default;
  friend auto operator<=>(const TileId& a, const TileId& b) {
    if (auto order = a.level <=> b.level; order != 0) return order;
    if (auto order = a.row <=> b.row; order != 0) return order;
    return a.col <=> b.col;
  }

  bool valid() const {
    return level >= 0 && level <= kMaxLevel && col >= 0 && row >= 0 && col < (1 << level) &&
           row < (1 << level);
  }
  bool isRoot() const { return level == 0; }
  /// Only for tiles other than the root.
  TileId parent() const { return {level - 1, col >> 1, row >> 1}; }
  /// The ancestor at `ancestorLevel` <= level.
  TileId ancestor(int ancestorLevel) const {
    return {ancestorLevel, col >> (level - ancestorLevel), row >> (level - ancestorLevel)};
  }
  /// Quadrant 0 north-west, 1 north-east, 2 south-west, 3 south-east.
  TileId child(int quadrant) const {
    return {level + 1, 2 * col + (quadrant & 1), 2 * row + (quadrant >> 1)};
  }
  /// Which quadrant of its parent this tile is.
  int quadrant() const { return (col & 1) | (row & 1) << 1; }
};

/// "level/col/row", as tiles are named in messages.
std::string toString(TileId id);

struct TileIdHash {
  size_t operator()(TileId id) const {
    const uint64_t key = static_cast<uint64_t>(id.level) << 48 | static_cast<uint64_t>(id.row) << 24 |
                         static_cast<uint64_t>(id.col);
    return static_cast<size_t>((key ^ key >> 29) * 0x9e3779b97f4a7c15ULL >> 7);
  }
};

}  // namespace terrane
