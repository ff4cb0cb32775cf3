#include <algorithm>
#include <limits>

#include "terrane/engine/read_flight.h"
#include "web_view.h"

/// Flights in pages.
namespace terrane {
namespace {

constexpr double kDegrees = 57.29577951308232;

}  // namespace

std::string WebView::loadFlight(const std::string& json) {
  flight_.reset();
  if (!isReady()) return "the dataset is not open yet";
  auto flight = flightOver(json, "the flight", *view_);
  if (!flight.ok()) return flight.error().message;
  flight_.emplace(std::move(flight).value());
  return {};
}

double WebView::flightSeconds() const {
  return flight_ ? flight_->durationSeconds() : std::numeric_limits<double>::quiet_NaN();
}

emscripten::val WebView::flightCamera(double seconds) {
  numbers_.clear();
  if (!flight_ || !isReady()) return numbers();
  const Frame& frame = view_->manifest().frame;
  const Camera camera = flight_->at(seconds, std::max(width_, 1), std::max(height_, 1));
  // The camera of a flight stands in the world as it is, without exaggeration. It looks at whatever is a
  // kilometre ahead.
  const glm::dvec3 eye = frame.crsFromLocal(camera.eyeLocal);
  const glm::dvec3 target = frame.crsFromLocal(camera.eyeLocal + 1000.0 * camera.forward);
  numbers_ = {eye.x, eye.y, eye.z, target.x, target.y, target.z, camera.fovyRadians * kDegrees};
  return numbers();
}

}  // namespace terrane
