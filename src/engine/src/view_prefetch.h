#pragma once

#include <optional>

#include "terrane/tiling/camera.h"

namespace terrane {

/// Where a camera will be soon, from where it was. A plain value.
class CameraForecast {
 public:
  void seen(const Camera& camera, double nowSeconds);
  /// The camera in `aheadSeconds`, moving and turning on as it did; nothing while it stands still.
  std::optional<Camera> ahead(double aheadSeconds) const;

 private:
  std::optional<Camera> last_;
  double lastSeconds_ = 0.0;
  glm::dvec3 metersPerSecond_{0.0};
  glm::dvec3 turnPerSecond_{0.0};  ///< of the viewing direction
};

}  // namespace terrane
