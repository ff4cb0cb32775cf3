#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/codec/tile.h"

/// Adaptive meshes of a tile's patches, first half: which samples become vertices. docs/architecture.md,
/// "Meshes", tells why neighbours meet.
///
/// A tile's meshes belong to one *mesh level*: the bintree level of their patches, less twice the tile's
/// level. Inside a patch the vertices are closed under "parent of" on the diamond lattice, so the mesh is
/// what longest-edge bisection makes of it. On a patch's sides they are given: those of a *leg* when its
/// level chooses vertices for the first time, those of a *hypotenuse* by the level before, whose patches have
/// it as a leg. So whatever two patches meet along a side, of one level or of two that follow each other, in
/// one tile or in two, they have the same vertices on it.
namespace terrane {

/// Mesh levels, and levels of vertices, in a tile: quad-centres of half-size 128 have 0, edge-centres of
/// half-size 1 have 15.
inline constexpr int kDeepestVertexLevel = 15;

/// What a sample is to the meshes of one level; bits.
enum MeshVertexBits : uint8_t {
  kMeshVertex = 1,  ///< a vertex of all patches that touch it
  /// On a side whose vertices are given, and not among them: needed by the inside of the patch on the side of
  /// the diamond's first or second apex, and taken out again when that patch's triangles are made.
  kMeshExtraFirst = 2,
  kMeshExtraSecond = 4,
};

/// Between which heights a surface passes each sample, in the samples' order; NaN where none is asked for.
struct HeightBand {
  std::vector<float> low;
  std::vector<float> high;
  float leastMeters = 0.0F;  ///< at least so far from the samples' own heights, everywhere
};

/// Which samples meshes are held against: ground, and what fills a void where ground is shown beside it; of a
/// finest tile ground alone, for there nothing is shown of a cell with a void corner. Where nothing is void
/// the result is empty: all.
std::vector<uint8_t> measuredSamples(const TileSamples& samples, bool isFinest);

/// Which level, and what holds along its patches' sides.
struct MeshLevelRule {
  int level = 0;
  /// Side in cells of the squares on whose borders vertices are given: the tile's or, on levels beyond its
  /// own, that of the deeper tiles which serve these levels elsewhere, next to this one perhaps.
  int borderSquare = kTileCells;
  /// How far chords along legs may leave the samples; 0: all samples with a height of their own are vertices
  /// there.
  double alongSidesMeters = 0.0;
};

/// Chooses the vertices of a mesh level: one MeshVertexBits a sample; corners of patches, which always are
/// vertices, are not marked. `inherited`: the vertices of the level before over the same samples
/// (inheritedVertices() where these are the parent tile's; empty for the world's first level); they stay. The
/// surface keeps to `band`, but where a side's given vertices do not let it. Depends on the tile's samples,
/// `inherited`, band and rule alone; what is given on the tile's border, on samples of that border, what is
/// inherited there, and the rule. About half a millisecond.
std::vector<uint8_t> chooseMeshVertices(const TileSamples& samples, const HeightBand& band,
                                        std::span<const uint8_t> inherited, const MeshLevelRule& rule);

/// The vertices of a parent's quadrant over the samples of the child.
std::vector<uint8_t> inheritedVertices(std::span<const uint8_t> parent, int quadrant);

/// The surface that a level's vertices make, at every sample: own heights at vertices and at what is coarser
/// than `level`, means of the hypotenuse's ends elsewhere. `centerFalls`: does the tile's own hypotenuse run
/// from north-west to south-east (col + row is even)? 0.2 ms.
std::vector<float> meshSurface(std::span<const float> heights, std::span<const uint8_t> vertices, int level,
                               bool centerFalls);

}  // namespace terrane
