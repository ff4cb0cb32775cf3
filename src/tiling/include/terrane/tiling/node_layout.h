#pragma once

#include <cstdint>

#include "terrane/tiling/lattice.h"

/// Which diamonds' error codes a tile carries, and where each stands in the tile's arrays.
///
/// A tile carries the diamonds of its own patches for K = 17, the smallest K that codes are stored for: the
/// bintree levels 7 + 2 * tileLevel (edge-centres) and 8 + 2 * tileLevel (quad-centres); the root also those
/// above. *Node level* is the bintree level less 2 * tileLevel: 7 and 8, in the root 0 to 8. Edge-centres on
/// a tile's border stand in both tiles, with equal codes.
namespace terrane {

inline constexpr PatchGrid kNodeGrid{.k = 4};
inline constexpr int kNodeLevels = 9;           ///< node levels 0 to 8
inline constexpr int kFirstInnerNodeLevel = 7;  ///< the first that a tile other than the root carries

/// Quads (even levels) or edges (odd levels) along a tile's side at a node level.
constexpr int nodeGridSide(int nodeLevel) {
  return 1 << (nodeLevel / 2);
}
/// Nodes of one node level in one tile.
constexpr int nodeCount(int nodeLevel) {
  const int side = nodeGridSide(nodeLevel);
  return nodeLevel % 2 == 0 ? side * side : 2 * side * (side + 1);
}
/// The first node level that a tile carries.
constexpr int firstNodeLevel(bool isRoot) {
  return isRoot ? 0 : kFirstInnerNodeLevel;
}
/// Where a node level begins in a tile's arrays.
constexpr int nodeOffset(int nodeLevel, bool isRoot) {
  int offset = 0;
  for (int level = firstNodeLevel(isRoot); level < nodeLevel; ++level) offset += nodeCount(level);
  return offset;
}
/// All nodes of a tile: 400, in the root 541.
constexpr int tileNodeCount(bool isRoot) {
  return nodeOffset(kNodeLevels, isRoot);
}

/// Half-size, in the tile's cells, of a node level's diamonds.
constexpr int nodeHalfSize(int nodeLevel) {
  return kTileCells >> (nodeLevel / 2 + 1);
}

/// Error codes of patches with K = 33, 65 and 129 (k = 5, 6, 7), which tiles carry too: a larger patch is
/// saturated over its own hierarchy, so its code does not follow from those for K = 17. For each such k the
/// tile carries the node levels 15 - 2k and 16 - 2k, the root those above as well. Height ranges do not
/// depend on K.
constexpr int firstLargeNodeLevel(int k, bool isRoot) {
  return isRoot ? 0 : 15 - 2 * k;
}
constexpr int lastLargeNodeLevel(int k) {
  return 16 - 2 * k;
}
/// Where the codes of patches of this k begin; with k = 8 the count of all: 140, in the root 187.
constexpr int largeNodeOffset(int k, bool isRoot) {
  int offset = 0;
  for (int smaller = kNodeGrid.k + 1; smaller < k; ++smaller)
    for (int level = firstLargeNodeLevel(smaller, isRoot); level <= lastLargeNodeLevel(smaller); ++level)
      offset += nodeCount(level);
  return offset;
}
constexpr int tileLargeNodeCount(bool isRoot) {
  return largeNodeOffset(PatchGrid::kLargest + 1, isRoot);
}
/// Like nodeIndex(), in the array of larger patches' codes.
int largeNodeIndex(int k, int nodeLevel, int x, int y, bool isRoot);

/// The index in the tile's arrays of the diamond at tile-local cell coordinates (x, y) in [0, 256] of a node
/// level that the tile carries. The diamond must be there.
int nodeIndex(int nodeLevel, int x, int y, bool isRoot);

/// Tile-local centre of the node at `index` of a tile's arrays, and its node level.
struct NodePlace {
  int nodeLevel = 0;
  int x = 0;
  int y = 0;
};
NodePlace nodePlace(int index, bool isRoot);

}  // namespace terrane
