#include "geographic.h"

#include <proj.h>

#include <cmath>

namespace terrane::serve {

struct Geographic::Transform {
  PJ_CONTEXT* context = nullptr;
  PJ* transform = nullptr;
  Transform() = default;
  Transform(const Transform&) = delete;
  Transform& operator=(const Transform&) = delete;
  ~Transform() {
    if (transform != nullptr) proj_destroy(transform);
    if (context != nullptr) proj_context_destroy(context);
  }
};

Geographic::Geographic(std::string crsWkt) : crsWkt_(std::move(crsWkt)) {}
Geographic::~Geographic() = default;

std::unique_ptr<Geographic::Transform> Geographic::take() {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      auto transform = std::move(idle_.back());
      idle_.pop_back();
      return transform;
    }
  }
  auto made = std::make_unique<Transform>();
  made->context = proj_context_create();
  proj_log_level(made->context, PJ_LOG_NONE);
  proj_context_set_enable_network(made->context, 0);
  PJ* plain = proj_create_crs_to_crs(made->context, "OGC:CRS84", crsWkt_.c_str(), nullptr);
  if (plain != nullptr) {
    // East before north on both sides, as rasters have it.
    made->transform = proj_normalize_for_visualization(made->context, plain);
    proj_destroy(plain);
  }
  return made;
}

void Geographic::giveBack(std::unique_ptr<Transform> transform) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(transform));
}

std::optional<glm::dvec2> Geographic::crsFromGeographic(glm::dvec2 degrees) {
  auto transform = take();
  std::optional<glm::dvec2> out;
  if (transform->transform != nullptr) {
    const PJ_COORD result =
        proj_trans(transform->transform, PJ_FWD, proj_coord(degrees.x, degrees.y, 0.0, HUGE_VAL));
    if (std::isfinite(result.xy.x) && std::isfinite(result.xy.y)) out = glm::dvec2(result.xy.x, result.xy.y);
    proj_errno_reset(transform->transform);
  }
  giveBack(std::move(transform));
  return out;
}

bool Geographic::available() {
  auto transform = take();
  const bool there = transform->transform != nullptr;
  giveBack(std::move(transform));
  return there;
}

}  // namespace terrane::serve
