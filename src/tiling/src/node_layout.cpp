#include "terrane/tiling/node_layout.h"

#include <array>

#include "terrane/base/check.h"

namespace terrane {

namespace {

constexpr int kTileBits = 8;
static_assert(kTileCells == 1 << kTileBits);

/// The place of a diamond among a tile's diamonds of its level: quad-centres row by row; edge-centres first
/// those on horizontal edges, then those on vertical ones.
int indexInLevel(int nodeLevel, int x, int y) {
  const int half = nodeLevel / 2;
  const int side = nodeGridSide(nodeLevel);
  // Sides of quads are powers of two.
  const int col = x >> (kTileBits - half);
  const int row = y >> (kTileBits - half);
  if (nodeLevel % 2 == 0) return (row << half) + col;
  const bool onHorizontalEdge = (x & nodeHalfSize(nodeLevel)) != 0;
  return onHorizontalEdge ? (row << half) + col : side * (side + 1) + row * (side + 1) + col;
}

constexpr std::array<int, kNodeLevels + 1> nodeOffsets(bool isRoot) {
  std::array<int, kNodeLevels + 1> out{};
  for (int level = 0; level <= kNodeLevels; ++level)
    out[static_cast<size_t>(level)] = nodeOffset(level, isRoot);
  return out;
}
constexpr std::array<std::array<int, kNodeLevels + 1>, 2> kNodeOffsets = {nodeOffsets(false),
                                                                          nodeOffsets(true)};

}  // namespace

int nodeIndex(int nodeLevel, int x, int y, bool isRoot) {
  return kNodeOffsets[isRoot ? 1 : 0][static_cast<size_t>(nodeLevel)] + indexInLevel(nodeLevel, x, y);
}

int largeNodeIndex(int k, int nodeLevel, int x, int y, bool isRoot) {
  int offset = largeNodeOffset(k, isRoot);
  for (int level = firstLargeNodeLevel(k, isRoot); level < nodeLevel; ++level) offset += nodeCount(level);
  return offset + indexInLevel(nodeLevel, x, y);
}

NodePlace nodePlace(int index, bool isRoot) {
  TERRANE_CHECK(index >= 0 && index < tileNodeCount(isRoot), "node {}", index);
  int level = firstNodeLevel(isRoot);
  while (index >= nodeCount(level)) index -= nodeCount(level++);
  const int side = nodeGridSide(level);
  const int s = nodeHalfSize(level);
  if (level % 2 == 0) return {level, (2 * (index % side) + 1) * s, (2 * (index / side) + 1) * s};
  if (index < side * (side + 1)) return {level, (2 * (index % side) + 1) * s, 2 * (index / side) * s};
  index -= side * (side + 1);
  return {level, 2 * (index % (side + 1)) * s, (2 * (index / (side + 1)) + 1) * s};
}

}  // namespace terrane
