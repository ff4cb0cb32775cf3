#include "view_prefetch.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace terrane {
namespace {

/// How quickly the forecast follows a change: share of the new speed, a second.
constexpr double kFollowPerSecond = 8.0;

}  // namespace

void CameraForecast::seen(const Camera& camera, double nowSeconds) {
  const double elapsed = nowSeconds - lastSeconds_;
  if (last_ && elapsed <= 0.0) return;
  if (last_ && elapsed < 1.0) {
    const double share = std::min(1.0, kFollowPerSecond * elapsed);
    metersPerSecond_ += share * ((camera.eyeLocal - last_->eyeLocal) / elapsed - metersPerSecond_);
    turnPerSecond_ += share * ((camera.forward - last_->forward) / elapsed - turnPerSecond_);
  } else {
    metersPerSecond_ = turnPerSecond_ = glm::dvec3(0.0);
  }
  last_ = camera;
  lastSeconds_ = nowSeconds;
}

std::optional<Camera> CameraForecast::ahead(double aheadSeconds) const {
  if (!last_ || (glm::length(metersPerSecond_) < 1e-6 && glm::length(turnPerSecond_) < 1e-6))
    return std::nullopt;
  const glm::dvec3 eye = last_->eyeLocal + aheadSeconds * metersPerSecond_;
  const glm::dvec3 towards = last_->forward + aheadSeconds * turnPerSecond_;
  if (glm::length(towards) < 0.2) return std::nullopt;
  return lookAt(eye, eye + glm::normalize(towards), last_->fovyRadians, last_->width, last_->height);
}

}  // namespace terrane
