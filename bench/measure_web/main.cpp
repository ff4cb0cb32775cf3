#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "terrane/engine/read_flight.h"
#include "terrane/measure/bench_result.h"
#include "terrane/measure/fly.h"

/// The cameras of a flight's steps, so that programs other than ours can fly it: a JSON array of {"eye",
/// "target": [easting, northing, height] in the dataset's CRS, "fovy": degrees}. A target is a kilometre
/// ahead.
///
/// usage: measure_web_cameras FLIGHT.json DATASET STEPS STEPS_A_SECOND WIDTH HEIGHT CAMERAS.json

namespace terrane {
namespace {

constexpr double kAheadMeters = 1000.0;

Status run(const std::vector<std::string>& arguments) {
  if (arguments.size() != 7)
    return makeError(
        "usage: measure_web_cameras FLIGHT.json DATASET STEPS STEPS_A_SECOND WIDTH HEIGHT CAMERAS.json");
  TERRANE_ASSIGN(const std::unique_ptr<Terrain> terrain,
                 Terrain::open(arguments[1], {.forceSoftware = true}));
  TERRANE_ASSIGN(const FittedFlight flight, readFlight(arguments[0], *terrain));
  const Frame& frame = terrain->dataset().manifest().frame;
  const int steps = std::stoi(arguments[2]);
  const double stepsASecond = std::stod(arguments[3]);
  FlyOptions fly;
  fly.width = std::stoi(arguments[4]);
  fly.height = std::stoi(arguments[5]);

  nlohmann::json cameras = nlohmann::json::array();
  for (int step = 0; step <= steps; ++step) {
    const Camera camera = cameraAt(flight, step / stepsASecond, fly);
    const auto place = [&](glm::dvec3 local) {
      const glm::dvec3 crs = frame.crsFromLocal(local);
      return nlohmann::json{crs.x, crs.y, crs.z};
    };
    cameras.push_back({{"eye", place(camera.eyeLocal)},
                       {"target", place(camera.eyeLocal + kAheadMeters * camera.forward)},
                       {"fovy", camera.fovyRadians * 180.0 / 3.14159265358979324}});
  }
  return writeTextFile(arguments[6], cameras.dump() + "\n");
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  return terrane::benchMain("measure_web_cameras", argc, argv, terrane::run);
}
