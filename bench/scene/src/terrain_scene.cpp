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

Cut TerrainScene::select(const Camera& camera) {
  constexpr double kFrameSeconds = 0.02;
  // Whether it fades or not, this makes the meshes that the tiles allow.
  Cut whole = terrain_.select(camera, selection_);
  if (!fading_) return whole;
  const Manifest& manifest = terrain_.dataset().manifest();
  return selectPatches(selection_, manifest.frame, manifest.scale, camera, terrain_.tiles(), &*fading_,
                       kFrameSeconds);
}

Status TerrainScene::loadAll(const Camera& camera) {
  fading_.reset();
  const auto cut = terrain_.selectAndLoad(camera, selection_);
  return cut.ok() ? Status() : Status(cut.error());
}

Result<FrameCost> TerrainScene::drawFrame(const Camera& camera) {
  fading_.reset();
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
  const Cut cut = select(camera);
  TERRANE_ASSIGN(PositionPicture picture, terrain_.drawPositions(cut, camera, selection_.exaggeration));
  return std::move(picture.local);
}

Status TerrainScene::unload() {
  terrain_.tiles().clear();
  fading_.emplace();
  return load(TileId{});
}

Result<std::vector<TileId>> TerrainScene::wishes(const Camera& camera) {
  // What waits for its parents to fade in has not wished yet.
  Cut cut = select(camera);
  while (cut.wishes.empty() && cut.ramping > 0) cut = select(camera);
  std::vector<TileId> tiles;
  for (const TileWish& wish : cut.wishes) tiles.push_back(wish.tile);
  return tiles;
}

Status TerrainScene::load(TileId id) {
  return terrain_.tiles().load(std::array{id});
}

}  // namespace terrane
