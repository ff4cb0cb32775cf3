#include "node_code.h"

#include <algorithm>
#include <cstddef>

#include "terrane/tiling/node_layout.h"

namespace terrane {

namespace {

/// The centre of the diamond two levels up whose triangles hold both of the given one's.
void climbTwoLevels(int level, int& x, int& y) {
  const int s = kTileCells >> (level / 2 + 1);
  if (level % 2 == 0) {
    x = x / (4 * s) * (4 * s) + 2 * s;
    y = y / (4 * s) * (4 * s) + 2 * s;
    return;
  }
  // note: of the two neighbours along the hypotenuse exactly one is an edge-centre of twice the size.
  const bool horizontal = (x / s) % 2 != 0;
  int& along = horizontal ? x : y;
  const int across = horizontal ? y : x;
  const bool acrossIsOdd = (across / (2 * s)) % 2 != 0;
  const bool nextIsOdd = ((along + s) / (2 * s)) % 2 != 0;
  along += nextIsOdd != acrossIsOdd ? s : -s;
}

/// The diamond for K = 17 that stands for one of a smaller patch: two levels up for each halving of K, so
/// that its triangles hold the smaller ones and are drawn with the same samples. At most the coarsest there
/// is. note: inline, since it runs for each diamond, and for K >= 17 has nothing to do.
inline Diamond storedDiamond(const PatchGrid& grid, Diamond d) {
  for (int k = grid.k; k < kNodeGrid.k; ++k) {
    if (d.level < 2) return {kTileCells / 2, kTileCells / 2, 0};
    climbTwoLevels(d.level, d.x, d.y);
    d.level -= 2;
  }
  return d;
}

/// In a tile's cells and levels.
Diamond local(const SelectionContext& context, const Diamond& d, TileId id) {
  const int shift = context.lattice.depth() - id.level;
  return {(d.x >> shift) - id.col * kTileCells, (d.y >> shift) - id.row * kTileCells, d.level - 2 * id.level};
}

/// By the height range of the diamond itself, or for smaller patches of the one that stands for it.
void widenRange(NodeCode& code, const SelectionContext& context, const Diamond& diamond,
                const KnownTile& tile) {
  if (tile.residency != Residency::Resident) {
    code.low = std::min(code.low, tile.low);
    code.high = std::max(code.high, tile.high);
    return;
  }
  // note: the same diamond as for the error, or ranges would not nest from level to level.
  const Diamond d = storedDiamond(context.grid, local(context, diamond, tile.id));
  const auto at = static_cast<size_t>(nodeIndex(d.level, d.x, d.y, tile.id.isRoot()));
  code.low = std::min(code.low, tile.tile->nodes.low[at]);
  code.high = std::max(code.high, tile.tile->nodes.high[at]);
}

}  // namespace

void NodeCode::widen(const SelectionContext& context, const Diamond& d, const PatchGround& ground) {
  widenRange(*this, context, d, *ground.ranged);
  if (context.isMeshes || ground.tile->residency != Residency::Resident) return;
  error = std::max(error, errorCode(context, d, *ground.tile));
}

uint8_t errorCode(const SelectionContext& context, const Diamond& d, const KnownTile& tile) {
  return nodeErrorCode(context.grid, tile.tile->nodes, tile.id.isRoot(), local(context, d, tile.id));
}

uint8_t nodeErrorCode(const PatchGrid& grid, const TileNodes& nodes, bool isRoot, const Diamond& d) {
  if (grid.k > kNodeGrid.k)
    return nodes.largeError[static_cast<size_t>(largeNodeIndex(grid.k, d.level, d.x, d.y, isRoot))];
  // Above the coarsest diamond that stands for one nothing is known.
  if (d.level < 2 * (kNodeGrid.k - grid.k)) return 255;
  const Diamond stored = storedDiamond(grid, d);
  return nodes.error[static_cast<size_t>(nodeIndex(stored.level, stored.x, stored.y, isRoot))];
}

}  // namespace terrane
