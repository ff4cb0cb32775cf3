#include "terrane/scene/terrain_scene.h"

#include <algorithm>
#include <array>
#include <chrono>

namespace terrane {

TerrainScene::TerrainScene(Terrain& terrain, const PatchSelection& selection)
    : terrain_(terrain), selection_(selection) {
  const Manifest& manifest = terrain.dataset().manifest();
  style_.lowMeters = manifest.minHeight;
  style_.highMeters = std::max(manifest.maxHeight, manifest.minHeight + 1.0);
  style_.tauPixels = selection.tolerancePixels;
}

Status TerrainScene::loadAll(const Camera& camera) {
  const auto cut = terrain_.selectAndLoad(camera, selection_);
  return cut.ok() ? Status() : Status(cut.error());
}

Result<FrameCost> TerrainScene::drawFrame(const Camera& camera) {
  const uint64_t bytesBefore = terrain_.tiles().bytesRead();
  const size_t tilesBefore = terrain_.tiles().residentTiles();
  const auto start = std::chrono::steady_clock::now();
  TERRANE_ASSIGN(const Cut cut, terrain_.selectAndLoad(camera, selection_));
  TERRANE_ASSIGN(const Picture picture, terrain_.draw(cut, camera, style_));
  const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - start;

  const FrameReport& report = terrain_.report();
  FrameCost cost;
  cost.timeMs = spent.count();
  cost.selectMs = report.selectMilliseconds;
  cost.drawMs = report.drawMilliseconds;
  cost.triangles = report.triangles;
  cost.patches = report.patches;
  cost.tiles = report.tiles;
  cost.drawCalls = report.drawCalls;
  cost.bytes = terrain_.tiles().bytesRead() - bytesBefore;
  cost.requests = terrain_.tiles().residentTiles() - tilesBefore;
  cost.deepestLevel = report.deepestLevel;
  cost.memoryBytes = report.residentBytes + report.gpuBytes;
  return cost;
}

Result<std::vector<glm::dvec3>> TerrainScene::places(const Camera& camera) {
  const Cut cut = terrain_.select(camera, selection_);
  TERRANE_ASSIGN(PositionPicture picture, terrain_.drawPositions(cut, camera, selection_.exaggeration));
  return std::move(picture.local);
}

Status TerrainScene::unload() {
  terrain_.tiles().clear();
  return load(TileId{});
}

Result<std::vector<TileId>> TerrainScene::wishes(const Camera& camera) {
  std::vector<TileId> tiles;
  for (const TileWish& wish : terrain_.select(camera, selection_).wishes) tiles.push_back(wish.tile);
  return tiles;
}

Status TerrainScene::load(TileId id) {
  return terrain_.tiles().load(std::array{id});
}

}  // namespace terrane
