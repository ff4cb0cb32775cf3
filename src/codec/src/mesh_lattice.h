#pragma once

#include "terrane/tiling/tile_id.h"

/// The diamond lattice (tiling/lattice.h) inside one tile, as meshes walk it: by level, with coordinates.
namespace terrane {

/// A sample of a tile.
struct MeshPoint {
  int x = 0;
  int y = 0;
  int index() const { return y * kTileSamples + x; }
  bool isInTile() const { return x >= 0 && y >= 0 && x <= kTileCells && y <= kTileCells; }
  friend bool operator==(const MeshPoint&, const MeshPoint&) = default;
};

/// Half-size of the diamonds of a level.
constexpr int meshHalfSize(int level) {
  return kTileCells >> (level / 2 + 1);
}

/// A diamond's four neighbours: the ends of its hypotenuse, and its apexes, of which one may lie beyond the
/// tile.
struct MeshDiamond {
  MeshPoint ends[2];
  MeshPoint apexes[2];
};

/// `falls`: does a quad-centre's hypotenuse run from north-west to south-east?
inline MeshDiamond quadDiamond(MeshPoint p, int s, bool falls) {
  const MeshPoint northWest{p.x - s, p.y - s}, northEast{p.x + s, p.y - s};
  const MeshPoint southWest{p.x - s, p.y + s}, southEast{p.x + s, p.y + s};
  if (falls) return {{northWest, southEast}, {northEast, southWest}};
  return {{northEast, southWest}, {northWest, southEast}};
}
inline MeshDiamond edgeDiamond(MeshPoint p, int s, bool horizontal) {
  const MeshPoint west{p.x - s, p.y}, east{p.x + s, p.y}, north{p.x, p.y - s}, south{p.x, p.y + s};
  if (horizontal) return {{west, east}, {north, south}};
  return {{north, south}, {west, east}};
}

/// The diamond of a level (at least 1) at a sample. note: a tile's side is an even number of squares of every
/// size below its own, so that the checkerboard of hypotenuses is the same in all tiles.
inline MeshDiamond meshDiamondAt(MeshPoint p, int level) {
  const int s = meshHalfSize(level);
  if (level % 2 == 0) return quadDiamond(p, s, (((p.x / s) ^ (p.y / s)) & 2) == 0);
  return edgeDiamond(p, s, (p.x / s) % 2 != 0);
}

/// On which side of a diamond, that of its first or second apex, does a point lie?
inline int sideOf(const MeshDiamond& diamond, MeshPoint center, MeshPoint point) {
  const MeshPoint apex = diamond.apexes[0];
  return (apex.x - center.x) * (point.x - center.x) + (apex.y - center.y) * (point.y - center.y) > 0 ? 0 : 1;
}

/// Calls visit(point) for every sample of a level, row by row.
template <class Visit>
inline void visitMeshLevel(int level, Visit&& visit) {
  const int s = meshHalfSize(level);
  if (level % 2 == 0) {
    for (int y = s; y <= kTileCells; y += 2 * s)
      for (int x = s; x <= kTileCells; x += 2 * s) visit(MeshPoint{x, y});
    return;
  }
  for (int y = 0; y <= kTileCells; y += s)
    for (int x = (y / s) % 2 == 0 ? s : 0; x <= kTileCells; x += 2 * s) visit(MeshPoint{x, y});
}

/// Where a mesh level's patches have their sides.
struct MeshSides {
  int level;
  int square;  ///< side of the squares whose sides and diagonals they are, in cells

  explicit MeshSides(int meshLevel)
      : level(meshLevel), square(kTileCells >> (meshLevel - meshLevel % 2) / 2) {}
  /// On the border of a tile: this one or, beyond its own levels, one below it that has the level's patches
  /// for its own. note: where that is not stored and its neighbour is, this tile's patches meet the
  /// neighbour's there.
  bool onTileBorder(MeshPoint p) const {
    const int side = level % 2 == 0 && level > 0 ? 2 * square : square;
    return p.x % side == 0 || p.y % side == 0;
  }
  bool onLine(MeshPoint p) const { return p.x % square == 0 || p.y % square == 0; }
  /// On the diagonal of its square along which a patch of an even level has its hypotenuse.
  bool onHypotenuseDiagonal(MeshPoint p) const {
    const int x = p.x % square, y = p.y % square;
    if (square == kTileCells) return false;  // both triangles of the world's first level are one patch each
    return ((p.x / square + p.y / square) & 1) == 0 ? x == y : x + y == square;
  }
  /// Are the vertices here given: on a hypotenuse, or on a tile's border?
  bool isGiven(MeshPoint p) const {
    if (onTileBorder(p)) return true;
    return level % 2 == 0 ? !onLine(p) && onHypotenuseDiagonal(p) : onLine(p);
  }
};

}  // namespace terrane
