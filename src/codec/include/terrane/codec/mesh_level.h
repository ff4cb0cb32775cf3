#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/codec/mesh_relief.h"
#include "terrane/codec/patch_mesh.h"
#include "terrane/codec/tile.h"
#include "terrane/tiling/frame.h"
#include "terrane/tiling/lattice.h"

/// All meshes of a tile's patches of one mesh level (mesh_vertices.h), and how wrong each is.
namespace terrane {

/// Which meshes a dataset's tiles have, and how far they may be from the full-resolution source. The bound
/// falls by the square root of 2 from one bintree level to the next; half of it or so is what the tile's own
/// samples leave, the rest is for the meshes.
struct MeshScale {
  /// Which bintree levels a tile serves: those whose patches have as many of its samples along their sides.
  PatchGrid grid{.k = 7};
  /// The bound of a right-angle patch, in spacings of the samples that it is made of. The rougher the ground,
  /// the larger: the samples must leave enough of it to the meshes (decision 89).
  double boundSpacings = 2.0;
  double spacingMeters = 1.0;  ///< of the finest data level, the larger of x and y
  int finestLevel = 0;
  /// Layers of significance, and how far the samples of each are from those of all, metres
  /// (ElevationScale::layerOffset()).
  int layerCount = 1;
  std::array<double, ElevationScale::kMostLayers> layerOffsets{};
  double sampleErrorMeters = 0.0;  ///< of all layers together

  static MeshScale of(const Frame& frame, const ElevationScale& scale);
  /// Bound of the patches of a bintree level, metres; 0 from deepestLevel() on: all that is known.
  double boundMeters(int bintreeLevel) const;
  /// The deepest bintree level: where the finest tiles' patches have 16 cells along a leg.
  int deepestLevel() const { return 2 * finestLevel + kDeepestOfFinest; }

  /// By how much more than its nodes' codes say a tile may be off the source while only layers up to this one
  /// are used. Of the finest tiles that is known better: a layer's samples keep to its bound themselves.
  double layerOffset(int layer, bool isFinest) const {
    const double offset = layerOffsets[static_cast<size_t>(layer)];
    return isFinest && layer + 1 < layerCount ? offset - 2.0 * sampleErrorMeters : offset;
  }
  /// Which layers of significance the meshes of a bintree level are made of: those up to this one. Samples
  /// may take a share of the level's bound; a level alone decides, so that neighbours are made of the same.
  int layerOf(int bintreeLevel) const;

  /// The least error that meshes of a bintree level state, metres: their bound, or what layers of
  /// significance leave of it.
  double leastStatedMeters(int bintreeLevel) const;

  /// Mesh levels of a tile: from the first on, at least to the last of its own; beyond, where no deeper tile
  /// is stored, to the deepest.
  int firstLevel(bool isRoot) const { return isRoot ? 0 : lastOwnLevel() - 1; }
  int lastOwnLevel() const { return grid.rootLevels(); }
  static constexpr int kDeepestOfFinest = 8;
};

/// The meshes of one mesh level of a tile, those of all its patches one after the other.
struct MeshLevel {
  struct Patch {
    uint32_t firstVertex = 0;
    uint32_t vertexCount = 0;
    uint32_t firstIndex = 0;  ///< indices count from the patch's first vertex
    uint32_t indexCount = 0;
    uint32_t bisectedCount = 0;  ///< triangles of bisection; those after them replace extra vertices
    uint32_t firstExtra = 0;
    uint32_t extraCount = 0;
    float errorMeters = 0.0F;  ///< bound against the full-resolution source
    /// The same where its morph begins: of its triangles with their vertices' coarse heights. That is not
    /// quite the level before where triangles beside sides are cut otherwise.
    float startErrorMeters = 0.0F;
  };
  int level = 0;
  bool centerFalls = false;    ///< of the tile; see meshSurface()
  std::vector<Patch> patches;  ///< patchCount(level), by patchIndex()
  std::vector<PatchVertex> vertices;
  std::vector<uint16_t> indices;
  std::vector<uint32_t> extras;  ///< places of the extra vertices that were taken out
  std::vector<uint8_t> chosen;   ///< a bit a sample, lowest first: the vertices that the next level inherits
  MeshRelief relief;

  size_t sizeBytes() const {
    return sizeof(*this) + patches.size() * sizeof(Patch) + vertices.size() * sizeof(PatchVertex) +
           indices.size() * sizeof(uint16_t) + extras.size() * sizeof(uint32_t) + chosen.size() +
           relief.sizeBytes();
  }
};

/// The largest error that a tile's meshes of a level state over one of its quadrants: known before they, or
/// the layers that they are made of, are there. Some hundred nanoseconds.
double statedErrorOver(int quadrant, TileId id, const Tile& tile, int level, const MeshScale& meshScale,
                       const ElevationScale& scale);

/// Makes a mesh level of a tile, which must have the layers that it is made of. `before`: the level before of
/// the same tile or, for a tile's first level, the last own one of its parent; null for the world's first. A
/// pure function, any thread; one to three milliseconds.
MeshLevel makeMeshLevel(TileId id, const Tile& tile, int level, const MeshLevel* before,
                        const MeshScale& meshScale, const ElevationScale& scale);

}  // namespace terrane
