#pragma once

#include "terrane/engine/terrain.h"
#include "terrane/measure/fly.h"

namespace terrane {

/// A dataset drawn by the engine, as a FlightScene. `terrain` must live longer; several scenes may take turns
/// with it.
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
  Terrain& terrain_;
  PatchSelection selection_;
  RenderStyle style_;
};

}  // namespace terrane
