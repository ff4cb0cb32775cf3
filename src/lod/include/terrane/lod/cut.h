#pragma once

#include <cstdint>
#include <vector>

#include "terrane/tiling/lattice.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

/// How a patch becomes triangles.
enum class SurfaceKind : uint8_t {
  Patches,  ///< all its tile's samples that a K-patch has: the same template for each
  Meshes,   ///< those of them that its bound needs: an adaptive mesh of its own (codec/mesh_level.h)
};

/// Where a patch's mesh is in the tile that it is cut out of: which mesh level, and which patch of it.
struct MeshPlacement {
  int level = 0;
  int index = 0;  ///< meaningful for level <= kDeepestVertexLevel only
};

/// One patch to draw.
struct Patch {
  Triangle triangle;         ///< in cells of the cut's lattice depth
  TileId tile;               ///< whose samples are its vertices' heights
  TileId shadingTile;        ///< the same or a descendant that holds the whole patch: normals and coverage
  float errorPixels = 0.0F;  ///< bound of the geometric error on screen
  /// How far it has become itself, 0 to 1: 0 shows the same surface as its bintree parent, 1 its own heights
  /// (docs/architecture.md, "Morphing"). The same for all patches that the split of one diamond made.
  float morph = 1.0F;
  MeshPlacement mesh{};    ///< for SurfaceKind::Meshes
  uint32_t triangles = 0;  ///< of that mesh
};

/// A tile that would improve the picture if it were here, and by how much it matters. All numbers are finite.
struct TileWish {
  TileId tile;
  int layer = 0;                  ///< layers of significance up to this one
  float errorPixels = 0.0F;       ///< largest error on screen of the patches that wait for it
  float errorAfterPixels = 0.0F;  ///< an estimate of what is left of it once the tile is here
  float areaPixels = 0.0F;        ///< about as much of the picture shows the diamonds that wait; at least 1
};

/// A tile's mesh level that would improve the picture if it were made.
struct MeshWish {
  TileId tile;  ///< is resident
  int level = 0;
  friend bool operator==(const MeshWish&, const MeshWish&) = default;
};

/// The patches that a camera needs and the resident tiles allow: they cover what is in view of the world
/// once, and meet without T-junctions.
struct Cut {
  int latticeDepth = 0;  ///< unit of all lattice coordinates here
  SurfaceKind surface = SurfaceKind::Patches;
  PatchGrid grid;
  std::vector<Patch> patches;
  std::vector<Patch> hidden;     ///< in the frustum, but hidden by those: not to be drawn; only meshes
  std::vector<TileWish> wishes;  ///< most error first; parents are resident
  std::vector<MeshWish>
      meshWishes;   ///< for SurfaceKind::Meshes, coarse ones first; the levels before are made
  int ramping = 0;  ///< diamonds that are fading in: while there are any, the same view changes with time
};

}  // namespace terrane
