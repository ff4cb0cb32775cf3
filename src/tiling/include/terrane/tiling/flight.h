#pragma once

#include <array>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/tiling/camera.h"
#include "terrane/tiling/frame.h"

namespace terrane {

/// A camera path in time as a file says it (docs/flights.md, docs/format/flight.schema.json): key frames in
/// design metres, which fit any dataset, or in the coordinates of one CRS. A plain value.
struct Flight {
  enum class Coordinates { Relative, Crs };
  enum class HeightAbove { Ground, Highest };
  enum class Look { Target, Angles, Ahead };
  enum class Interpolation { Smooth, Linear };

  struct Key {
    double time = 0.0;       ///< seconds, ascending, the first is 0
    glm::dvec3 eye{0.0};     ///< relative: design metres east and north of the middle, and up; else E, N, H
    glm::dvec3 target{0.0};  ///< Look::Target: the same, its height above the ground there
    double headingDegrees = 0.0;  ///< Look::Angles: clockwise from north; 720 is two turns
    double pitchDegrees = 0.0;    ///< Look::Angles, Look::Ahead: above the horizon, -90 to 90
    double fovyDegrees = 45.0;    ///< vertical field of view, 1 to 170
  };

  std::string name;
  std::string description;
  Coordinates coordinates = Coordinates::Relative;
  double halfSideMeters = 10000.0;  ///< half the shorter side of the dataset that design metres were made for
  HeightAbove heightAbove = HeightAbove::Ground;
  double smoothingMeters = 500.0;  ///< design metres of path over which the ground's profile is smoothed
  double seekLowMeters = 0.0;      ///< design metres around each key in which it moves to the lowest ground
  Look look = Look::Ahead;
  Interpolation interpolation = Interpolation::Smooth;
  std::vector<Key> keys;  ///< at least one

  double durationSeconds() const { return keys.back().time; }
};

/// Parses and checks a flight; `where` (a path) begins every message, which names the member that is wrong.
/// Unknown members are errors, so that a misspelt one is not silently ignored.
Result<Flight> flightFromJson(const std::string& text, const std::string& where);

/// What a flight must know of a dataset to fit itself to it. Local metres.
struct FlightGround {
  glm::dvec2 southWestLocal{0.0};  ///< of the box around the samples that can hold data
  glm::dvec2 northEastLocal{0.0};
  double minHeight = 0.0;  ///< over ground
  double maxHeight = 0.0;
  /// The full-resolution surface's height at a place, NaN where there is no ground. Asked at most some
  /// 20,000 times along the path and 300 times a key; the flight is as deterministic as its answers.
  std::function<double(glm::dvec2 local)> heightAt;
};

/// A flight laid over one dataset.
class FittedFlight {
 public:
  double durationSeconds() const { return times_.back(); }
  /// The camera at a time, clamped to the flight; sizes in pixels. The same numbers for the same arguments,
  /// all finite.
  Camera at(double seconds, int width, int height) const;
  /// Local metres for each design metre; 1 for flights in CRS coordinates.
  double scale() const { return scale_; }

 private:
  friend Result<FittedFlight> fitFlight(const Flight&, const Frame&, const FlightGround&);

  /// What is interpolated between key frames, one curve each.
  enum Channel { EyeX, EyeY, EyeZ, TargetX, TargetY, TargetZ, Heading, Pitch, Fovy, kChannels };
  struct Curve {
    std::vector<double> values;
    std::vector<double> slopes;
  };
  double value(Channel channel, double seconds) const;
  glm::dvec2 eyeGround(double seconds) const { return {value(EyeX, seconds), value(EyeY, seconds)}; }
  void setCurve(Channel channel, std::vector<double> values);
  void surveyProfile(const FlightGround& ground, double stepMeters, double smoothingMeters);
  double profileAt(double seconds) const;

  double scale_ = 1.0;
  Flight::Look look_ = Flight::Look::Ahead;
  Flight::Interpolation interpolation_ = Flight::Interpolation::Smooth;
  std::vector<double> times_;
  std::array<Curve, kChannels> curves_;
  std::vector<double>
      profile_;  ///< smoothed ground under the path at equal times; empty: heights are absolute
};

/// Lays a flight over a dataset, by the rule of docs/flights.md: a relative flight is moved to the middle of
/// the dataset's box and scaled, heights included, by half the box's shorter side / halfSideMeters; heights
/// then stand above the smoothed ground under the path, or above the dataset's highest point. Cost: the
/// heights that it asks for. Error: an empty or non-finite box.
Result<FittedFlight> fitFlight(const Flight& flight, const Frame& frame, const FlightGround& ground);

}  // namespace terrane
