#include <cmath>
#include <cstdint>
#include <string>

#include "terrane/base/check.h"
#include "terrane/tiling/flight.h"

/// The input is a flight's text; what is accepted is fitted to a small hilly box and flown.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace terrane;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const Result<Flight> flight = flightFromJson(text, "fuzz");
  if (!flight.ok()) return 0;

  FlightGround ground;
  ground.southWestLocal = {0.0, -8000.0};
  ground.northEastLocal = {10000.0, 0.0};
  ground.minHeight = 100.0;
  ground.maxHeight = 1100.0;
  ground.heightAt = [](glm::dvec2 p) {
    const bool inside = p.x >= 0.0 && p.y <= 0.0 && p.x <= 10000.0 && p.y >= -8000.0;
    return inside ? 600.0 + 500.0 * std::sin(p.x / 900.0) * std::cos(p.y / 700.0) : std::nan("");
  };
  const Result<FittedFlight> fitted = fitFlight(*flight, Frame{.spacingX = 10.0, .spacingY = 10.0}, ground);
  if (!fitted.ok()) return 0;
  for (const double share : {0.0, 0.37, 1.0}) {
    const Camera camera = fitted->at(share * fitted->durationSeconds(), 640, 360);
    for (const glm::dvec3& v : {camera.eyeLocal, camera.right, camera.up, camera.forward})
      TERRANE_CHECK(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z));
  }
  return 0;
}
