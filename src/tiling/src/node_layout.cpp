#include "terrane/tiling/node_layout.h"

#include "terrane/base/check.h"

namespace terrane {

namespace {

/// The place of a diamond among a tile's diamonds of its level: quad-centres row by row; edge-centres first
/// those on horizontal edges, then those on vertical ones.
int indexInLevel(int nodeLevel, int x, int y) {
  const int side = nodeGridSide(nodeLevel);
  const int s = nodeHalfSize(nodeLevel);
  const int col = x / (2 * s);
  const int row = y / (2 * s);
  if (nodeLevel % 2 == 0) return row * side + col;
  const bool onHorizontalEdge = (x / s) % 2 != 0;
  return onHorizontalEdge ? row * side + col : side * (side + 1) + row * (side + 1) + col;
}

}  // namespace

int nodeIndex(int nodeLevel, int x, int y, bool isRoot) {
  return nodeOffset(nodeLevel, isRoot) + indexInLevel(nodeLevel, x, y);
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
