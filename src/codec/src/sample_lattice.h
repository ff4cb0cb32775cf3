#pragma once

#include "terrane/tiling/tile_id.h"

/// The diamond lattice (tiling/lattice.h) inside one tile, as indices into its samples: the order in which
/// samples become known. Tile-local coordinates have the world's parity because a tile's side is even at
/// every half-size that is walked here.
namespace terrane {

/// Half-size of the quad-centre in the middle of a tile: where the root's lattice begins.
inline constexpr int kCoarsestHalfSize = kTileCells / 2;
/// That of the coarsest samples that a tile holds itself.
constexpr int coarsestHalfSize(bool isRoot) {
  return isRoot ? kCoarsestHalfSize : 1;
}

/// Quad-centres of half-size s in one tile, and edge-centres.
constexpr int quadCenterCount(int s) {
  return (kTileCells / (2 * s)) * (kTileCells / (2 * s));
}
constexpr int edgeCenterCount(int s) {
  return 2 * (kTileCells / (2 * s)) * (kTileCells / (2 * s) + 1);
}

/// Calls visit(center, end, end, apex, apex) with the sample indices of every quad-centre of half-size s,
/// row by row from the north-west: its hypotenuse's ends and the other two corners.
template <class Visit>
inline void visitQuadCenters(int s, Visit&& visit) {
  const int up = s * kTileSamples;
  for (int y = s; y < kTileSamples; y += 2 * s) {
    bool northWestIsEnd = (y - s) / (2 * s) % 2 == 0;
    for (int x = s; x < kTileSamples; x += 2 * s) {
      const int center = y * kTileSamples + x;
      // The other two corners of a square lie across its other diagonal.
      const int turn = northWestIsEnd ? s : -s;
      visit(center, center - up - turn, center + up + turn, center - up + turn, center + up - turn);
      northWestIsEnd = !northWestIsEnd;
    }
  }
}

/// Calls visit(center, end, end, apex, apex) for every edge-centre of half-size s, row by row from the
/// north-west: its hypotenuse's ends and the quad-centres beside it. On the tile's border, where one of
/// these lies in another tile, the ends stand for both.
template <class Visit>
inline void visitEdgeCenters(int s, Visit&& visit) {
  const int up = s * kTileSamples;
  const auto visitHorizontal = [&](int y, bool onBorder) {
    for (int x = s; x < kTileSamples; x += 2 * s) {
      const int center = y * kTileSamples + x;
      if (onBorder) {
        visit(center, center - s, center + s, center - s, center + s);
      } else {
        visit(center, center - s, center + s, center - up, center + up);
      }
    }
  };
  const auto visitVertical = [&](int y) {
    const int west = y * kTileSamples;
    const int east = west + kTileCells;
    visit(west, west - up, west + up, west - up, west + up);
    for (int center = west + 2 * s; center < east; center += 2 * s) {
      visit(center, center - up, center + up, center - s, center + s);
    }
    visit(east, east - up, east + up, east - up, east + up);
  };

  visitHorizontal(0, true);
  for (int y = s; y < kTileSamples; y += 2 * s) {
    visitVertical(y);
    visitHorizontal(y + s, y + s == kTileCells);
  }
}

}  // namespace terrane
