#pragma once

#include <cstdint>
#include <vector>

#include "terrane/tiling/lattice.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

/// One K-patch to draw.
struct Patch {
  Triangle triangle;         ///< in cells of the cut's lattice depth
  TileId tile;               ///< whose samples are its vertices' heights
  TileId shadingTile;        ///< the same or a descendant that holds the whole patch: normals and coverage
  float errorPixels = 0.0F;  ///< bound of the geometric error on screen
};

/// A tile that would improve the picture if it were here, and by how much it matters.
struct TileWish {
  TileId tile;
  float errorPixels = 0.0F;  ///< error on screen of the patch that waits for it
};

/// The patches that a camera needs and the resident tiles allow: they cover what is in view of the world
/// once, and meet without T-junctions.
struct Cut {
  int latticeDepth = 0;  ///< unit of all lattice coordinates here
  PatchGrid grid;
  std::vector<Patch> patches;
  std::vector<TileWish> wishes;  ///< most urgent first; parents are resident
};

}  // namespace terrane
