#pragma once

#include <glm/vec2.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::serve {

/// Where a dataset's CRS lies on its body, by PROJ. Any thread.
class Geographic {
 public:
  /// `crsWkt` is the dataset's. Made even where PROJ cannot relate the two; then nothing can be transformed.
  explicit Geographic(std::string crsWkt);
  ~Geographic();

  /// Longitude and latitude in degrees.
  static constexpr const char* kDegrees = "EPSG:4326";

  /// CRS coordinates of (longitude, latitude), or nothing where the projection has none for it.
  std::optional<glm::dvec2> crsFromGeographic(glm::dvec2 degrees);
  /// The same of many places, and the other way; not a number where there is none. A microsecond each.
  std::vector<glm::dvec2> crsFromGeographic(std::span<const glm::dvec2> degrees);
  std::vector<glm::dvec2> geographicFromCrs(std::span<const glm::dvec2> crs);
  /// CRS coordinates of places in another CRS, which PROJ finds by its name ("EPSG:2056"): east before north,
  /// whatever its own order; not a number where there is none. The first places in a CRS take
  /// tens of milliseconds.
  std::vector<glm::dvec2> crsFrom(const std::string& name, std::span<const glm::dvec2> places);
  /// Metres on the CRS's ellipsoid from the beginning of a line, straight in the CRS between its corners, to
  /// each of them. Nothing where PROJ cannot tell, for one of them. A microsecond or two a corner, and one
  /// for each 20 km between.
  std::optional<std::vector<double>> metersAlong(std::span<const glm::dvec2> cornersCrs);
  /// Can PROJ relate the dataset's CRS to this one at all? Made when first asked for; tens of milliseconds.
  bool available(const std::string& name = kDegrees);

 private:
  struct Transform;
  std::unique_ptr<Transform> take(const std::string& name);
  void giveBack(const std::string& name, std::unique_ptr<Transform> transform);
  std::vector<glm::dvec2> transformed(const std::string& name, std::span<const glm::dvec2> places,
                                      bool forward);

  std::string crsWkt_;
  std::mutex mutex_;
  /// By the other CRS's name; one a thread that asked at the same time.
  std::map<std::string, std::vector<std::unique_ptr<Transform>>> idle_;
};

}  // namespace terrane::serve
