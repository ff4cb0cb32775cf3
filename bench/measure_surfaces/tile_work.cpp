#include "tile_work.h"

#include <algorithm>
#include <utility>

#include "cpu_time.h"
#include "terrane/codec/all_layers.h"
#include "terrane/codec/elevation_codec.h"

namespace terrane {
namespace {

/// A tile in memory, and what its children's meshes begin with.
struct MadeTile {
  Tile tile;
  MeshLevel lastOwn;
};

}  // namespace

void UsedTiles::add(const Cut& cut) {
  for (const Patch& patch : cut.patches) {
    addTile(patch.tile);
    addTile(patch.shadingTile);
    if (cut.surface == SurfaceKind::Meshes)
      addMeshes(patch.tile, patch.triangle.diamond.level - 2 * patch.tile.level);
  }
}

void UsedTiles::addTile(TileId id) {
  while (deepest_.emplace(id, -1).second && !id.isRoot()) id = id.parent();
}

void UsedTiles::addMeshes(TileId id, int level) {
  // A tile's own levels are made together.
  level = std::max(level, meshScale_.lastOwnLevel());
  while (deepest_.at(id) < level) {
    deepest_.at(id) = level;
    if (id.isRoot()) return;
    id = id.parent();
    level = meshScale_.lastOwnLevel();
  }
}

Result<TileWork> doTileWork(const Dataset& dataset, const UsedTiles& used) {
  const Manifest& manifest = dataset.manifest();
  const MeshScale meshScale = MeshScale::of(manifest.frame, manifest.scale);
  std::map<TileId, MadeTile> made;
  TileWork out;
  for (const auto& [id, deepest] : used.deepestMeshLevels()) {
    TERRANE_ASSIGN(const auto payloads, dataset.readAllLayers(id));
    if (!payloads) continue;  // interpolated from its parent, and drawn from there
    const MadeTile* parent = id.isRoot() ? nullptr : &made.at(id.parent());
    double begin = threadSeconds();
    TERRANE_ASSIGN(Tile tile, decodeAllLayers(*payloads, parent != nullptr ? &parent->tile.samples : nullptr,
                                              id.isRoot() ? 0 : id.quadrant(), manifest.scale));
    out.decodeSeconds += threadSeconds() - begin;
    ++out.tiles;
    MadeTile& here = made[id];
    here.tile = std::move(tile);

    MeshLevel before;
    for (int level = meshScale.firstLevel(id.isRoot()); level <= deepest; ++level) {
      const bool isFirst = level == meshScale.firstLevel(id.isRoot());
      const MeshLevel* last = !isFirst ? &before : parent != nullptr ? &parent->lastOwn : nullptr;
      begin = threadSeconds();
      MeshLevel meshes = makeMeshLevel(id, here.tile, level, last, meshScale, manifest.scale);
      out.meshSeconds += threadSeconds() - begin;
      ++out.meshLevels;
      out.meshTriangles += static_cast<int64_t>(meshes.indices.size() / 3);
      out.meshBytes += meshes.sizeBytes();
      if (level == meshScale.lastOwnLevel()) here.lastOwn = meshes;
      before = std::move(meshes);
    }
  }
  return out;
}

}  // namespace terrane
