#pragma once

#include <algorithm>

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

/// The level of the diamond at a sample; -1 at a tile's corners.
inline int vertexLevel(MeshPoint p) {
  const auto bits = static_cast<unsigned>(p.x) | static_cast<unsigned>(p.y);
  const int s = static_cast<int>(bits & (~bits + 1U));
  if (s == 0 || s >= kTileCells) return -1;
  int level = 0;
  while (meshHalfSize(level) > s) level += 2;
  return (p.x / s) % 2 != 0 && (p.y / s) % 2 != 0 ? level : level + 1;
}

/// Twice the signed area; positive where a, b, c turn from x towards y.
constexpr int doubleArea(MeshPoint a, MeshPoint b, MeshPoint c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// The samples of a row that lie in a triangle whose corners turn from x towards y.
struct RowSpan {
  int first = 0;
  int last = -1;
};
inline RowSpan rowOf(const MeshPoint (&corners)[3], int y) {
  const auto floorDivide = [](int a, int b) { return a % b != 0 && a < 0 ? a / b - 1 : a / b; };
  RowSpan out{0, kTileCells};
  for (int i = 0; i < 3; ++i) {
    // On the inner side of the edge p-q: (q - p) x (point - p) >= 0, linear in the point's x.
    const MeshPoint p = corners[i], q = corners[(i + 1) % 3];
    const int slope = p.y - q.y;
    const int rest = (q.x - p.x) * (y - p.y) - slope * p.x;
    if (slope > 0) out.first = std::max(out.first, -floorDivide(rest, slope));
    if (slope < 0) out.last = std::min(out.last, floorDivide(rest, -slope));
    if (slope == 0 && rest < 0) out.last = -1;
  }
  return out;
}

/// Side, in cells, of the squares whose sides and diagonals are the sides of a mesh level's patches.
constexpr int meshSquare(int level) {
  return kTileCells >> level / 2;
}

/// Where a mesh level's patches have sides whose vertices are given: on hypotenuses, and on the borders of
/// tiles.
struct GivenSides {
  int level;
  int square;  ///< of the patches
  int border;  ///< side of the squares, in cells, on whose borders vertices are given

  GivenSides(int meshLevel, int borderSquare)
      : level(meshLevel), square(meshSquare(meshLevel)), border(borderSquare) {}
  bool has(MeshPoint p) const {
    if (p.x % border == 0 || p.y % border == 0) return true;
    const bool onLine = p.x % square == 0 || p.y % square == 0;
    return level % 2 == 0 ? !onLine && onHypotenuse(p) : onLine;
  }

 private:
  /// On the diagonal of its square along which patches of an even level have their hypotenuses.
  bool onHypotenuse(MeshPoint p) const {
    if (square == kTileCells) return false;  // the two triangles of the world's first level choose together
    const int x = p.x % square, y = p.y % square;
    return ((p.x / square + p.y / square) & 1) == 0 ? x == y : x + y == square;
  }
};

}  // namespace terrane
