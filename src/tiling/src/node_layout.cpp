#include "terrane/tiling/node_layout.h"

#include "terrane/base/check.h"

namespace terrane {

int nodeIndex(int nodeLevel, int x, int y, bool isRoot) {
  const int side = nodeGridSide(nodeLevel);
  const int s = nodeHalfSize(nodeLevel);
  const int offset = nodeOffset(nodeLevel, isRoot);
  const int col = x / (2 * s);
  const int row = y / (2 * s);
  if (nodeLevel % 2 == 0) return offset + row * side + col;
  const bool onHorizontalEdge = (x / s) % 2 != 0;
  if (onHorizontalEdge) return offset + row * side + col;
  return offset + side * (side + 1) + row * (side + 1) + col;
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
