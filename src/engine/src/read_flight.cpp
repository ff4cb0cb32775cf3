#include "terrane/engine/read_flight.h"

#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

#include "terrane/engine/elevation_query.h"

namespace terrane {

namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

FlightGround groundOf(const Manifest& manifest) {
  const GroundBox box = groundBoxOf(manifest);
  FlightGround ground;
  ground.southWestLocal = {box.low.x, box.low.y};
  ground.northEastLocal = {box.high.x, box.high.y};
  ground.minHeight = manifest.minHeight;
  ground.maxHeight = manifest.maxHeight;
  return ground;
}

}  // namespace

Result<FittedFlight> readFlight(const std::string& path, const Terrain& terrain) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) return makeError("{}: cannot be read; does it exist?", path);
  TERRANE_ASSIGN(const Flight flight, flightFromJson(text.str(), path));

  const Manifest& manifest = terrain.dataset().manifest();
  ElevationQuery query(terrain.dataset());
  std::optional<Error> failed;
  FlightGround ground = groundOf(manifest);
  ground.heightAt = [&](glm::dvec2 place) {
    const auto height = query.heightAt(place);
    if (!height.ok() && !failed) failed = height.error();
    return height.ok() && *height ? **height : kNothing;
  };
  auto fitted = fitFlight(flight, manifest.frame, ground);
  if (failed) return *failed;
  return fitted;
}

Result<FittedFlight> flightOver(const std::string& text, const std::string& where, const TerrainView& view) {
  TERRANE_ASSIGN(const Flight flight, flightFromJson(text, where));
  const Frame& frame = view.manifest().frame;
  Surface surface = view.surface();
  FlightGround ground = groundOf(view.manifest());
  ground.heightAt = [&](glm::dvec2 place) {
    const auto height = surface.heightAt(frame.sampleFromLocal(place));
    return height.ok() && *height ? **height : kNothing;
  };
  return fitFlight(flight, frame, ground);
}

}  // namespace terrane
