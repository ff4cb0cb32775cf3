#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "terrane/codec/mesh_vertices.h"

/// Adaptive meshes of a tile's patches, second half: vertices and triangles.
namespace terrane {

/// A vertex of a patch's mesh; the record that drawing reads. 12 bytes.
struct PatchVertex {
  uint32_t place = 0;         ///< the tile's sample: x in bits 0 to 8, y in bits 9 to 17; others 0
  float heightMeters = 0.0F;  ///< the sample's own
  float coarseMeters = 0.0F;  ///< what the level before shows there: where its morph begins

  int x() const { return static_cast<int>(place & 511U); }
  int y() const { return static_cast<int>(place >> 9 & 511U); }
};
static_assert(sizeof(PatchVertex) == 12);

/// The adaptive mesh of one patch. Vertices stand row by row from the north-west. First come the triangles of
/// bisection: of each vertex, in their order, those that its split made and that are not split on, north,
/// east, south, west of a quad-centre, north-east, south-east, south-west, north-west of an edge-centre. Then
/// those that replace extra vertices.
struct PatchMesh {
  std::vector<PatchVertex> vertices;
  std::vector<uint16_t> indices;   ///< three a triangle, from x towards y (clockwise on the map)
  int64_t bisected = 0;            ///< triangles of bisection
  std::vector<uint32_t> extras;    ///< places of the extra vertices that were taken out, row by row
  bool hasMore = false;            ///< vertices inside beyond those that were chosen
  double excessMeters = 0.0;       ///< by how much the surface leaves the band, on a side with given vertices
  double startExcessMeters = 0.0;  ///< what triangles that replace extra vertices do, at their coarse heights

  int64_t triangles() const { return static_cast<int64_t>(indices.size() / 3); }
};

/// A patch in its tile's samples.
struct PatchCorners {
  std::array<std::array<int, 2>, 2> ends{};  ///< of its hypotenuse, (x, y)
  std::array<int, 2> apex{};
};

/// Where the patches of a mesh level are: patchCorners() of 0 to patchCount() - 1. An even level has two in
/// each square of its grid, an odd one four. `centerFalls` (see meshSurface()) concerns level 0.
int patchCount(int level);
PatchCorners patchCorners(int level, int index, bool centerFalls);
/// The patch of a mesh level that has this centre of the hypotenuse and this apex.
int patchIndex(int level, std::array<int, 2> middle, std::array<int, 2> apex);

/// The mesh of a patch of a level, from chooseMeshVertices() and meshSurface() of the level before. Sides
/// have the vertices that are given and no others; what the inside needs beyond them is taken out, the hole
/// that it leaves is cut into triangles again, and where these leave the band the inside gets more vertices.
/// 50 ns a triangle.
PatchMesh makePatchMesh(const PatchCorners& corners, int level, std::span<const uint8_t> vertices,
                        std::span<const float> heights, std::span<const float> coarse,
                        const HeightBand& band);

}  // namespace terrane
