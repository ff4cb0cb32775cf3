#pragma once

#include <optional>

#include "terrane/engine/terrain.h"
#include "terrane/measure/fly.h"

namespace terrane {

/// A dataset drawn by the engine, as a FlightScene. From unload() until the next loadAll() or drawFrame()
/// what arrives fades in, a fiftieth of a second with each look at the scene; else all that is loaded shows
/// at once. `terrain` must live longer; several scenes may take turns with it.
class TerrainScene final : public FlightScene {
 public:
  TerrainScene(Terrain& terrain, const PatchSelection& selection);

  Status loadAll(const Camera& camera) override;
  Result<FrameCost> drawFrame(const Camera& camera) override;
  Result<std::vector<glm::dvec3>> places(const Camera& camera) override;
  Status unload() override;
  Result<std::vector<TileId>> wishes(const Camera& camera) override;
  Status load(TileId id) override;

 private:
  Cut select(const Camera& camera);

  Terrain& terrain_;
  PatchSelection selection_;
  RenderStyle style_;
  std::optional<MorphHistory> fading_;
};

}  // namespace terrane
