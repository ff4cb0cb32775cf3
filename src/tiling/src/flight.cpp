#include "terrane/tiling/flight.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <glm/geometric.hpp>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

namespace terrane {
namespace {

using Json = nlohmann::json;

constexpr double kPi = 3.14159265358979323846;
constexpr double kRadiansPerDegree = kPi / 180.0;
constexpr size_t kMaxTextBytes = 4U << 20;
constexpr size_t kMaxKeys = 10000;
constexpr double kMaxSeconds = 86400.0;
constexpr double kMaxMeters = 1e9;
constexpr int kMaxProfileSteps = 20000;
constexpr int kSeekRings = 8;

/// Reads the members of one JSON object: remembers what was asked for and the first thing that was wrong.
class Members {
 public:
  Members(const Json& object, std::string path) : object_(object), path_(std::move(path)) {}

  bool has(const char* name) {
    known_.insert(name);
    return object_.contains(name);
  }

  double number(const char* name, double low, double high) {
    if (!has(name)) return missing(name), low;
    return checkedNumber(object_[name], fmt::format("{}{}", path_, name), low, high);
  }
  double number(const char* name, double low, double high, double otherwise) {
    return has(name) ? number(name, low, high) : otherwise;
  }

  glm::dvec3 point(const char* name) {
    if (!has(name)) return missing(name), glm::dvec3(0.0);
    const Json& list = object_[name];
    const std::string path = fmt::format("{}{}", path_, name);
    if (!list.is_array() || list.size() != 3) {
      fail(fmt::format("\"{}\" must be an array of three numbers: east, north, height", path));
      return glm::dvec3(0.0);
    }
    const auto coordinate = [&](size_t i) { return checkedNumber(list[i], path, -kMaxMeters, kMaxMeters); };
    return {coordinate(0), coordinate(1), coordinate(2)};
  }

  std::string text(const char* name, const std::string& otherwise) {
    if (!has(name)) return otherwise;
    if (!object_[name].is_string()) {
      fail(fmt::format("\"{}{}\" must be a string", path_, name));
      return otherwise;
    }
    return object_[name].get<std::string>();
  }

  /// The position of a member's value in `choices`; the first where the member is absent.
  size_t choice(const char* name, std::initializer_list<const char*> choices) {
    const std::string value = text(name, *choices.begin());
    size_t position = 0;
    for (const char* choice : choices) {
      if (value == choice) return position;
      ++position;
    }
    fail(fmt::format("\"{}{}\" is \"{}\"; it must be one of \"{}\"", path_, name, value,
                     fmt::join(choices.begin(), choices.end(), "\", \"")));
    return 0;
  }

  void fail(std::string message) {
    if (error_.empty()) error_ = std::move(message);
  }

  /// What went wrong first, a member that nobody asked for included; empty: nothing.
  std::string finish() {
    for (const auto& item : object_.items()) {
      if (known_.count(item.key()) == 0) {
        fail(fmt::format("\"{}{}\" is not a member that this version knows here", path_, item.key()));
      }
    }
    return error_;
  }

 private:
  void missing(const char* name) { fail(fmt::format("\"{}{}\" is missing", path_, name)); }

  double checkedNumber(const Json& value, const std::string& path, double low, double high) {
    const double number = value.is_number() ? value.get<double>() : std::nan("");
    if (number >= low && number <= high) return number;
    fail(fmt::format("\"{}\" must be a number from {} to {}", path, low, high));
    return low;
  }

  const Json& object_;
  std::string path_;
  std::set<std::string> known_;
  std::string error_;
};

std::string readKey(const Json& object, const std::string& path, const Flight& flight, double fovyDegrees,
                    Flight::Key& key) {
  if (!object.is_object()) return fmt::format("\"{}\" must be an object", path);
  Members members(object, path + ".");
  key.time = members.number("time", 0.0, kMaxSeconds);
  key.eye = members.point("eye");
  key.fovyDegrees = members.number("fovy", 1.0, 170.0, fovyDegrees);
  switch (flight.look) {
    case Flight::Look::Target:
      key.target = members.point("target");
      break;
    case Flight::Look::Angles:
      key.headingDegrees = members.number("heading", -1e6, 1e6);
      key.pitchDegrees = members.number("pitch", -90.0, 90.0);
      break;
    case Flight::Look::Ahead:
      key.pitchDegrees = members.number("pitch", -90.0, 90.0, 0.0);
      break;
  }
  return members.finish();
}

/// Slopes of a curve through the keys whose bends look natural (Catmull-Rom with unequal times).
std::vector<double> roundSlopes(const std::vector<double>& times, const std::vector<double>& values) {
  const size_t count = times.size();
  std::vector<double> slopes(count, 0.0);
  if (count < 2) return slopes;
  const auto secant = [&](size_t i) { return (values[i + 1] - values[i]) / (times[i + 1] - times[i]); };
  slopes.front() = secant(0);
  slopes.back() = secant(count - 2);
  for (size_t i = 1; i + 1 < count; ++i) {
    const double before = times[i] - times[i - 1];
    const double after = times[i + 1] - times[i];
    slopes[i] = (secant(i - 1) * after + secant(i) * before) / (before + after);
  }
  return slopes;
}

/// Slopes of a curve that never leaves the range of the two keys around it (Fritsch and Butland).
std::vector<double> monotoneSlopes(const std::vector<double>& times, const std::vector<double>& values) {
  const size_t count = times.size();
  std::vector<double> slopes = roundSlopes(times, values);
  for (size_t i = 1; i + 1 < count; ++i) {
    const double before = times[i] - times[i - 1];
    const double after = times[i + 1] - times[i];
    const double left = (values[i] - values[i - 1]) / before;
    const double right = (values[i + 1] - values[i]) / after;
    const double mean = (2.0 * after + before) * right + (after + 2.0 * before) * left;
    slopes[i] = left * right > 0.0 ? 3.0 * (before + after) * left * right / mean : 0.0;
  }
  return slopes;
}

/// The place within `radius` with the lowest ground; the middle itself where there is none lower.
glm::dvec2 lowestAround(glm::dvec2 middle, double radius, const FlightGround& ground) {
  glm::dvec2 best = middle;
  double lowest = ground.heightAt(middle);
  for (int ring = 1; ring <= kSeekRings; ++ring) {
    const int places = 8 * ring;
    for (int i = 0; i < places; ++i) {
      const double angle = 2.0 * kPi * i / places;
      const glm::dvec2 place =
          middle + radius * ring / kSeekRings * glm::dvec2(std::cos(angle), std::sin(angle));
      const double height = ground.heightAt(place);
      if (std::isfinite(height) && !(height >= lowest)) {
        lowest = height;
        best = place;
      }
    }
  }
  return best;
}

/// The parser's own words for what is wrong with a text, and where. (Its other way to tell is to throw.)
std::string whyNotJson(const std::string& text) {
  struct Listener final : nlohmann::json_sax<Json> {
    bool null() override { return true; }
    bool boolean(bool) override { return true; }
    bool number_integer(Json::number_integer_t) override { return true; }
    bool number_unsigned(Json::number_unsigned_t) override { return true; }
    bool number_float(Json::number_float_t, const std::string&) override { return true; }
    bool string(std::string&) override { return true; }
    bool binary(Json::binary_t&) override { return true; }
    bool start_object(size_t) override { return true; }
    bool key(std::string&) override { return true; }
    bool end_object() override { return true; }
    bool start_array(size_t) override { return true; }
    bool end_array() override { return true; }
    bool parse_error(size_t, const std::string&, const nlohmann::detail::exception& error) override {
      words = error.what();
      return false;
    }
    std::string words;
  };
  Listener listener;
  Json::sax_parse(text, &listener);
  return listener.words;
}

bool allFinite(const FlightGround& ground) {
  return std::isfinite(ground.southWestLocal.x) && std::isfinite(ground.southWestLocal.y) &&
         std::isfinite(ground.northEastLocal.x) && std::isfinite(ground.northEastLocal.y) &&
         std::isfinite(ground.minHeight) && std::isfinite(ground.maxHeight);
}

}  // namespace

Result<Flight> flightFromJson(const std::string& text, const std::string& where) {
  if (text.size() > kMaxTextBytes) {
    return makeError("{}: a flight of {} bytes; at most {} are read", where, text.size(), kMaxTextBytes);
  }
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return makeError("{}: not JSON: {}", where, whyNotJson(text));
  if (!json.is_object() || !json.contains("terraneFlight")) {
    return makeError("{}: not a flight: it must be an object with \"terraneFlight\": 1 (docs/flights.md)",
                     where);
  }

  Flight flight;
  Members members(json, "");
  if (members.number("terraneFlight", 1.0, 1e6) != 1.0) {
    return makeError("{}: a flight of a version that this program does not know; it reads version 1", where);
  }
  flight.name = members.text("name", "");
  flight.description = members.text("description", "");
  flight.coordinates = static_cast<Flight::Coordinates>(members.choice("coordinates", {"relative", "crs"}));
  flight.look = static_cast<Flight::Look>(members.choice("look", {"target", "angles", "ahead"}));
  flight.interpolation =
      static_cast<Flight::Interpolation>(members.choice("interpolation", {"smooth", "linear"}));
  const double fovyDegrees = members.number("fovy", 1.0, 170.0, 45.0);
  // What only says how to fit makes no sense for a flight that stands where it stands.
  if (flight.coordinates == Flight::Coordinates::Relative) {
    flight.halfSideMeters = members.number("halfSide", 1e-3, kMaxMeters);
    flight.heightAbove =
        static_cast<Flight::HeightAbove>(members.choice("heightAbove", {"ground", "highest"}));
    flight.smoothingMeters = members.number("smoothing", 0.0, kMaxMeters, 0.05 * flight.halfSideMeters);
    flight.seekLowMeters = members.number("seekLow", 0.0, kMaxMeters, 0.0);
  }

  const bool hasKeys = members.has("keys") && json["keys"].is_array() && !json["keys"].empty();
  if (!hasKeys || json["keys"].size() > kMaxKeys) {
    members.fail(fmt::format("\"keys\" must be an array of 1 to {} key frames", kMaxKeys));
  }
  if (const std::string wrong = members.finish(); !wrong.empty()) return makeError("{}: {}", where, wrong);
  for (size_t i = 0; i < json["keys"].size(); ++i) {
    Flight::Key key;
    const std::string path = fmt::format("keys[{}]", i);
    const std::string wrong = readKey(json["keys"][i], path, flight, fovyDegrees, key);
    if (!wrong.empty()) return makeError("{}: {}", where, wrong);
    if (i == 0 && key.time != 0.0) return makeError("{}: \"keys[0].time\" must be 0", where);
    if (i > 0 && key.time - flight.keys.back().time < 1e-3) {
      return makeError("{}: \"{}.time\" must be at least a millisecond after the key before it", where, path);
    }
    flight.keys.push_back(key);
  }
  return flight;
}

Result<FittedFlight> fitFlight(const Flight& flight, const Frame& frame, const FlightGround& ground) {
  TERRANE_CHECK(!flight.keys.empty(), "a flight without keys");
  const glm::dvec2 size = ground.northEastLocal - ground.southWestLocal;
  if (!allFinite(ground) || !(size.x > 0.0) || !(size.y > 0.0) || ground.maxHeight < ground.minHeight) {
    return makeError("flight \"{}\": the dataset has no ground to fly over", flight.name);
  }

  const bool relative = flight.coordinates == Flight::Coordinates::Relative;
  const glm::dvec2 middle = 0.5 * (ground.southWestLocal + ground.northEastLocal);
  FittedFlight fitted;
  fitted.scale_ = relative ? 0.5 * std::min(size.x, size.y) / flight.halfSideMeters : 1.0;
  fitted.look_ = flight.look;
  fitted.interpolation_ = flight.interpolation;
  const auto groundOrLowest = [&](glm::dvec2 place) {
    const double height = ground.heightAt(place);
    return std::isfinite(height) ? height : ground.minHeight;
  };

  // Bring every key to local metres; heights that follow the ground stay above it until the profile is known.
  std::array<std::vector<double>, FittedFlight::kChannels> values;
  for (const Flight::Key& key : flight.keys) {
    glm::dvec3 eye = frame.localFromCrs(key.eye);
    glm::dvec3 target = frame.localFromCrs(key.target);
    if (relative) {
      eye = glm::dvec3(middle, 0.0) + fitted.scale_ * key.eye;
      target = glm::dvec3(middle, 0.0) + fitted.scale_ * key.target;
      if (flight.look == Flight::Look::Target) target.z += groundOrLowest({target.x, target.y});
      if (flight.heightAbove == Flight::HeightAbove::Highest) eye.z += ground.maxHeight;
      if (flight.seekLowMeters > 0.0) {
        const glm::dvec2 low = lowestAround({eye.x, eye.y}, fitted.scale_ * flight.seekLowMeters, ground);
        eye = glm::dvec3(low, eye.z);
      }
    }
    fitted.times_.push_back(key.time);
    const double row[] = {
        eye.x,          eye.y, eye.z, target.x, target.y, target.z, key.headingDegrees, key.pitchDegrees,
        key.fovyDegrees};
    for (size_t channel = 0; channel < values.size(); ++channel) values[channel].push_back(row[channel]);
  }
  for (size_t channel = 0; channel < values.size(); ++channel) {
    fitted.setCurve(static_cast<FittedFlight::Channel>(channel), std::move(values[channel]));
  }

  if (relative && flight.heightAbove == Flight::HeightAbove::Ground) {
    const double step = 0.5 * std::min(frame.spacingXMeters(), frame.spacingYMeters());
    fitted.surveyProfile(ground, step, fitted.scale_ * flight.smoothingMeters);
  }
  return fitted;
}

void FittedFlight::setCurve(Channel channel, std::vector<double> values) {
  const bool round = channel == EyeX || channel == EyeY || channel == TargetX || channel == TargetY;
  Curve& curve = curves_[channel];
  curve.slopes = round ? roundSlopes(times_, values) : monotoneSlopes(times_, values);
  curve.values = std::move(values);
}

double FittedFlight::value(Channel channel, double seconds) const {
  const Curve& curve = curves_[channel];
  if (!(seconds > 0.0)) return curve.values.front();
  if (seconds >= times_.back()) return curve.values.back();
  const auto after =
      static_cast<size_t>(std::upper_bound(times_.begin(), times_.end(), seconds) - times_.begin());
  const size_t before = after - 1;
  const double length = times_[after] - times_[before];
  const double u = (seconds - times_[before]) / length;
  const double from = curve.values[before];
  const double step = curve.values[after] - from;
  if (interpolation_ == Flight::Interpolation::Linear) return from + u * step;

  // A cubic with the keys' values and slopes at its ends.
  const double startSlope = length * curve.slopes[before];
  const double endSlope = length * curve.slopes[after];
  return from + u * u * (3.0 - 2.0 * u) * step + u * (1.0 - u) * ((1.0 - u) * startSlope - u * endSlope);
}

void FittedFlight::surveyProfile(const FlightGround& ground, double stepMeters, double smoothingMeters) {
  // Measure the path coarsely, to know how many steps of the wanted length it has.
  double length = 0.0;
  const int coarseSteps = durationSeconds() > 0.0 ? 1000 : 0;
  for (int i = 0; i < coarseSteps; ++i) {
    const double from = durationSeconds() * i / coarseSteps;
    const double to = durationSeconds() * (i + 1) / coarseSteps;
    length += glm::length(eyeGround(to) - eyeGround(from));
  }
  const double wanted = stepMeters > 0.0 ? std::ceil(length / stepMeters) : 0.0;
  const int steps = static_cast<int>(std::clamp(wanted, 1.0, static_cast<double>(kMaxProfileSteps)));

  // The ground under the path and the way flown until there.
  std::vector<double> heights(static_cast<size_t>(steps) + 1);
  std::vector<double> ways(heights.size(), 0.0);
  glm::dvec2 last = eyeGround(0.0);
  for (size_t i = 0; i < heights.size(); ++i) {
    const glm::dvec2 place = eyeGround(durationSeconds() * static_cast<double>(i) / steps);
    heights[i] = ground.heightAt(place);
    if (i > 0) ways[i] = ways[i - 1] + glm::length(place - last);
    last = place;
  }

  // Where there is no ground, fly over what was there before, at the start over the first ground to come.
  double known = ground.minHeight;
  const auto first = std::find_if(heights.begin(), heights.end(), [](double h) { return std::isfinite(h); });
  if (first != heights.end()) known = *first;
  for (double& height : heights) {
    if (std::isfinite(height)) known = height;
    height = known;
  }

  // The highest ground within half the smoothing length, then the mean of that over the same length: smooth,
  // and nowhere below the ground.
  const double reach = 0.5 * smoothingMeters;
  std::vector<double> highest(heights.size());
  std::deque<size_t> candidates;
  for (size_t i = 0, end = 0; i < heights.size(); ++i) {
    for (; end < heights.size() && ways[end] <= ways[i] + reach; ++end) {
      while (!candidates.empty() && heights[candidates.back()] <= heights[end]) candidates.pop_back();
      candidates.push_back(end);
    }
    while (ways[candidates.front()] < ways[i] - reach) candidates.pop_front();
    highest[i] = heights[candidates.front()];
  }
  profile_.resize(heights.size());
  double sum = 0.0;
  for (size_t i = 0, begin = 0, end = 0; i < heights.size(); ++i) {
    for (; end < heights.size() && ways[end] <= ways[i] + reach; ++end)
      sum += highest[end] - ground.minHeight;
    for (; ways[begin] < ways[i] - reach; ++begin) sum -= highest[begin] - ground.minHeight;
    const double mean = ground.minHeight + sum / static_cast<double>(end - begin);
    profile_[i] = std::max(mean, heights[i]);
  }
}

double FittedFlight::profileAt(double seconds) const {
  if (profile_.empty()) return 0.0;
  const double last = static_cast<double>(profile_.size() - 1);
  const double share = durationSeconds() > 0.0 ? std::clamp(seconds / durationSeconds(), 0.0, 1.0) : 0.0;
  const auto before = static_cast<size_t>(std::min(std::floor(share * last), last - 1.0));
  const double u = share * last - static_cast<double>(before);
  return profile_[before] * (1.0 - u) + profile_[before + 1] * u;
}

Camera FittedFlight::at(double seconds, int width, int height) const {
  const double time = seconds > 0.0 ? std::min(seconds, durationSeconds()) : 0.0;
  const glm::dvec3 eye(eyeGround(time), value(EyeZ, time) + profileAt(time));
  const double fovy = std::clamp(value(Fovy, time), 1.0, 170.0) * kRadiansPerDegree;
  if (look_ == Flight::Look::Target) {
    const glm::dvec3 target(value(TargetX, time), value(TargetY, time), value(TargetZ, time));
    return lookAt(eye, target, fovy, width, height);
  }

  // Ahead is where the path goes over one second around now; while it stands, where the whole flight goes.
  double heading = value(Heading, time) * kRadiansPerDegree;
  if (look_ == Flight::Look::Ahead) {
    glm::dvec2 way = eyeGround(time + 0.5) - eyeGround(time - 0.5);
    if (!(glm::length(way) > 1e-6)) way = eyeGround(durationSeconds()) - eyeGround(0.0);
    heading = std::atan2(way.x, way.y);
  }
  const double pitch = value(Pitch, time) * kRadiansPerDegree;

  // Built from the angles, the camera keeps its heading where it looks straight down.
  Camera camera;
  camera.eyeLocal = eye;
  camera.right = {std::cos(heading), -std::sin(heading), 0.0};
  camera.forward = {std::sin(heading) * std::cos(pitch), std::cos(heading) * std::cos(pitch),
                    std::sin(pitch)};
  camera.up = glm::cross(camera.right, camera.forward);
  camera.fovyRadians = fovy;
  camera.width = width;
  camera.height = height;
  return camera;
}

}  // namespace terrane
