#pragma once

#include <glm/vec2.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace terrane::serve {

/// Longitudes and latitudes (degrees, WGS 84) to a dataset's CRS, by PROJ. Any thread.
class Geographic {
 public:
  /// `crsWkt` is the dataset's. Made even where PROJ cannot relate the two; then nothing can be transformed.
  explicit Geographic(std::string crsWkt);
  ~Geographic();

  /// CRS coordinates of (longitude, latitude), or nothing where the projection has none for it.
  std::optional<glm::dvec2> crsFromGeographic(glm::dvec2 degrees);
  /// Can PROJ relate the two at all? Made when first asked for; a millisecond.
  bool available();

 private:
  struct Transform;
  std::unique_ptr<Transform> take();
  void giveBack(std::unique_ptr<Transform> transform);

  std::string crsWkt_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Transform>> idle_;  ///< one a thread that asked at the same time
};

}  // namespace terrane::serve
