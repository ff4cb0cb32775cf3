#include "terrane/engine/read_flight.h"

#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

#include "terrane/engine/elevation_query.h"

namespace terrane {

Result<FittedFlight> readFlight(const std::string& path, const Terrain& terrain) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) return makeError("{}: cannot be read; does it exist?", path);
  TERRANE_ASSIGN(const Flight flight, flightFromJson(text.str(), path));

  const Manifest& manifest = terrain.dataset().manifest();
  const GroundBox box = terrain.groundBox();
  ElevationQuery query(terrain.dataset());
  std::optional<Error> failed;
  FlightGround ground;
  ground.southWestLocal = {box.low.x, box.low.y};
  ground.northEastLocal = {box.high.x, box.high.y};
  ground.minHeight = manifest.minHeight;
  ground.maxHeight = manifest.maxHeight;
  ground.heightAt = [&](glm::dvec2 place) {
    const auto height = query.heightAt(place);
    if (!height.ok() && !failed) failed = height.error();
    return height.ok() && *height ? **height : std::numeric_limits<double>::quiet_NaN();
  };
  auto fitted = fitFlight(flight, manifest.frame, ground);
  if (failed) return *failed;
  return fitted;
}

}  // namespace terrane
