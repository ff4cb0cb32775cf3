#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "terrane/engine/surface.h"
#include "terrane/stream/tile_stream.h"
#include "terrane/tiling/camera.h"

namespace terrane {

/// The ground that a stream has decoded: the finest tiles that are here.
class ViewGround final : public SurfaceSource {
 public:
  /// `stream` must outlive it.
  explicit ViewGround(const TileStream& stream) : stream_(stream) {}

  bool isReady() const { return stream_.phase() == StreamPhase::Ready; }
  const Manifest& manifest() const override { return stream_.manifest(); }
  Result<std::shared_ptr<const Tile>> get(TileId id, const Tile* parent) override;

 private:
  const TileStream& stream_;
};

/// See TerrainView.
std::optional<double> heightHere(ViewGround& ground, glm::dvec2 local);
std::optional<double> errorHere(ViewGround& ground, glm::dvec2 local);
std::optional<glm::dvec3> pickGround(ViewGround& ground, const Camera& camera, double exaggeration,
                                     glm::dvec2 pixel);

}  // namespace terrane
