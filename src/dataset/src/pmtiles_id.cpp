#include <utility>

#include "terrane/base/check.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {
namespace {

/// Tiles of all the levels above: 1 + 4 + ... + 4^(level - 1).
uint64_t tilesAbove(int level) {
  return ((uint64_t{1} << (2 * level)) - 1) / 3;
}

/// Turns the curve's quarter of side `side` that lies at (right, lower), so that quarters join end to end.
void turnQuarter(uint32_t side, uint32_t& x, uint32_t& y, bool right, bool lower) {
  if (lower) return;
  if (right) {
    x = side - 1 - x;
    y = side - 1 - y;
  }
  std::swap(x, y);
}

}  // namespace

uint64_t pmtilesId(TileId id) {
  TERRANE_CHECK(id.valid(), "tile {}", toString(id));
  auto x = static_cast<uint32_t>(id.col);
  auto y = static_cast<uint32_t>(id.row);
  uint64_t place = 0;
  for (uint32_t side = (uint32_t{1} << id.level) / 2; side > 0; side /= 2) {
    const bool right = (x & side) != 0;
    const bool lower = (y & side) != 0;
    place += uint64_t{side} * side * ((right ? 3U : 0U) ^ (lower ? 1U : 0U));
    x &= side - 1;
    y &= side - 1;
    turnQuarter(side, x, y, right, lower);
  }
  return tilesAbove(id.level) + place;
}

TileId tileIdFromPmtiles(uint64_t pmtilesId) {
  TERRANE_CHECK(pmtilesId < tilesAbove(kMaxLevel + 1), "PMTiles id {}", pmtilesId);
  int level = 0;
  while (pmtilesId >= tilesAbove(level + 1)) ++level;
  uint64_t place = pmtilesId - tilesAbove(level);
  uint32_t x = 0;
  uint32_t y = 0;
  for (uint32_t side = 1; side < (uint32_t{1} << level); side *= 2) {
    const bool right = (place & 2) != 0;
    const bool lower = ((place & 1) != 0) != right;
    turnQuarter(side, x, y, right, lower);
    x += right ? side : 0;
    y += lower ? side : 0;
    place /= 4;
  }
  return {level, static_cast<int32_t>(x), static_cast<int32_t>(y)};
}

}  // namespace terrane
