#pragma once

#include <glm/vec2.hpp>
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

  /// CRS coordinates of (longitude, latitude), or nothing where the projection has none for it.
  std::optional<glm::dvec2> crsFromGeographic(glm::dvec2 degrees);
  /// The same of many places, and the other way; not a number where there is none. A microsecond each.
  std::vector<glm::dvec2> crsFromGeographic(std::span<const glm::dvec2> degrees);
  std::vector<glm::dvec2> geographicFromCrs(std::span<const glm::dvec2> crs);
  /// Metres on the CRS's ellipsoid from the beginning of a line, straight in the CRS between its corners, to
  /// each of them. Nothing where PROJ cannot tell, for one of them. A microsecond or two a corner, and one
  /// for each 20 km between.
  std::optional<std::vector<double>> metersAlong(std::span<const glm::dvec2> cornersCrs);
  /// Can PROJ relate the two at all? Made when first asked for; a millisecond.
  bool available();

 private:
  struct Transform;
  std::unique_ptr<Transform> take();
  void giveBack(std::unique_ptr<Transform> transform);
  std::vector<glm::dvec2> transformed(std::span<const glm::dvec2> places, bool toGeographic);

  std::string crsWkt_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Transform>> idle_;  ///< one a thread that asked at the same time
};

}  // namespace terrane::serve
