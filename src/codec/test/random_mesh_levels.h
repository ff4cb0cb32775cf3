#pragma once

#include <functional>

#include "random_tiles.h"
#include "terrane/codec/mesh_level.h"

/// Mesh levels of tiles made up at random.
namespace terrane {

struct RandomMeshes {
  RandomTileOptions tiles;
  double boundSpacings = 2.0;
  int32_t largestErrorCode = 20;  ///< of the tiles' nodes
  int firstKept = 0;              ///< mesh levels before are made, and not shown
  int lastKept = kDeepestVertexLevel;
};

/// Another kind for each number: calm, rough, with holes, exact, hardly any triangles.
inline RandomMeshes randomMeshesOf(unsigned seed) {
  RandomMeshes out;
  out.tiles.roughness = seed % 4 == 1 ? 1 : seed % 4 == 2 ? 200 : 20;
  out.tiles.voidShare = seed % 3 == 0 ? 0.3 : 0.0;
  out.tiles.interpolatedShare = seed % 5 == 0 ? 0.5 : 0.1;
  out.tiles.partialCoverage = seed % 7 == 0;
  out.boundSpacings = seed % 6 == 5 ? 60.0 : seed % 2 == 0 ? 2.0 : 6.0;
  out.largestErrorCode = seed % 5 == 3 ? 63 : 20;
  return out;
}

/// Calls visit(meshes) for the mesh levels of a root tile and of one of its children, all of them.
inline void visitRandomMeshes(unsigned seed, const RandomMeshes& options,
                              const std::function<void(const MeshLevel&)>& visit) {
  std::mt19937 random(seed);
  const ElevationScale scale{.heightStep = 0.25, .errorUnit = 0.05};
  const MeshScale meshScale{.boundSpacings = options.boundSpacings, .spacingMeters = 1.0, .finestLevel = 1};
  const auto milder = [&](Tile tile) {
    for (uint8_t& code : tile.nodes.error) code = static_cast<uint8_t>(code % (options.largestErrorCode + 1));
    return tile;
  };
  const auto levelsOf = [&](TileId id, const Tile& tile, const MeshLevel* before) {
    MeshLevel own, last;
    for (int level = meshScale.firstLevel(id.isRoot()); level <= options.lastKept; ++level) {
      MeshLevel made = makeMeshLevel(id, tile, level, before, meshScale, scale);
      if (level >= options.firstKept) visit(made);
      if (level == meshScale.lastOwnLevel()) own = made;
      last = std::move(made);
      before = &last;
    }
    return own;
  };
  const TileId root{0, 0, 0};
  const Tile tile = milder(randomTile(root, nullptr, scale, options.tiles, random));
  const MeshLevel own = levelsOf(root, tile, nullptr);
  const TileId child = root.child(static_cast<int>(seed % 4));
  levelsOf(child, milder(randomTile(child, &tile.samples, scale, options.tiles, random)), &own);
}

}  // namespace terrane
