#include "geographic.h"

#include <geodesic.h>
#include <proj.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::serve {
namespace {

/// Lines longer than that are measured in parts: straight in a projection is not the shortest way.
constexpr double kPartMeters = 20e3;
constexpr double kMostParts = 64.0;
/// Transforms from so many other CRSs are kept for the next question.
constexpr size_t kMostKept = 16;

/// East before north on both sides, as rasters have it. Takes `plain` over.
PJ* eastBeforeNorth(PJ_CONTEXT* context, PJ* plain) {
  if (plain == nullptr) return nullptr;
  PJ* out = proj_normalize_for_visualization(context, plain);
  proj_destroy(plain);
  return out;
}

}  // namespace

struct Geographic::Transform {
  PJ_CONTEXT* context = nullptr;
  PJ* transform = nullptr;     ///< from the other CRS to the dataset's
  PJ* toOwnDegrees = nullptr;  ///< from the dataset's to longitude and latitude on its ellipsoid
  geod_geodesic ellipsoid{};
  Transform() = default;
  Transform(const Transform&) = delete;
  Transform& operator=(const Transform&) = delete;
  void findOwnDegrees(const std::string& crsWkt);
  ~Transform() {
    if (transform != nullptr) proj_destroy(transform);
    if (toOwnDegrees != nullptr) proj_destroy(toOwnDegrees);
    if (context != nullptr) proj_context_destroy(context);
  }
};

Geographic::Geographic(std::string crsWkt) : crsWkt_(std::move(crsWkt)) {}
Geographic::~Geographic() = default;

std::unique_ptr<Geographic::Transform> Geographic::take(const std::string& name) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto kept = idle_.find(name); kept != idle_.end() && !kept->second.empty()) {
      auto transform = std::move(kept->second.back());
      kept->second.pop_back();
      return transform;
    }
  }
  auto made = std::make_unique<Transform>();
  made->context = proj_context_create();
  proj_log_level(made->context, PJ_LOG_NONE);
  proj_context_set_enable_network(made->context, 0);
  // note: by its EPSG name, as a build warps; for "OGC:CRS84" PROJ takes another way from NAD83, a metre off.
  made->transform = eastBeforeNorth(
      made->context, proj_create_crs_to_crs(made->context, name.c_str(), crsWkt_.c_str(), nullptr));
  if (name == kDegrees) made->findOwnDegrees(crsWkt_);
  return made;
}

void Geographic::Transform::findOwnDegrees(const std::string& crsWkt) {
  const auto own = [](PJ* made) { return std::unique_ptr<PJ, decltype(&proj_destroy)>(made, proj_destroy); };
  auto crs = own(proj_create(context, crsWkt.c_str()));
  if (crs && proj_get_type(crs.get()) == PJ_TYPE_COMPOUND_CRS)
    crs = own(proj_crs_get_sub_crs(context, crs.get(), 0));
  if (!crs) return;
  const auto geodetic = own(proj_crs_get_geodetic_crs(context, crs.get()));
  if (!geodetic) return;
  const auto body = own(proj_get_ellipsoid(context, geodetic.get()));
  double semiMajor = 0.0, semiMinor = 0.0;
  if (!body ||
      proj_ellipsoid_get_parameters(context, body.get(), &semiMajor, &semiMinor, nullptr, nullptr) == 0)
    return;
  if (!(semiMajor > 0.0 && semiMinor > 0.0)) return;
  geod_init(&ellipsoid, semiMajor, (semiMajor - semiMinor) / semiMajor);
  PJ* found = eastBeforeNorth(
      context, proj_create_crs_to_crs_from_pj(context, crs.get(), geodetic.get(), nullptr, nullptr));
  // Some count in grads: their lengths stay unknown.
  if (found != nullptr && proj_degree_output(found, PJ_FWD) == 0) {
    proj_destroy(found);
    found = nullptr;
  }
  toOwnDegrees = found;
}

void Geographic::giveBack(const std::string& name, std::unique_ptr<Transform> transform) {
  const std::lock_guard lock(mutex_);
  // What leads nowhere takes nobody's place.
  const bool isWorthKeeping =
      transform->transform != nullptr && (idle_.size() < kMostKept || idle_.count(name) > 0);
  if (name != kDegrees && !isWorthKeeping) return;
  idle_[name].push_back(std::move(transform));
}

std::vector<glm::dvec2> Geographic::transformed(const std::string& name, std::span<const glm::dvec2> places,
                                                bool forward) {
  auto transform = take(name);
  PJ* const way = transform->transform;
  std::vector<glm::dvec2> out(places.size(), glm::dvec2(std::numeric_limits<double>::quiet_NaN()));
  for (size_t i = 0; i < places.size() && way != nullptr; ++i) {
    const PJ_COORD result =
        proj_trans(way, forward ? PJ_FWD : PJ_INV, proj_coord(places[i].x, places[i].y, 0.0, HUGE_VAL));
    if (std::isfinite(result.xy.x) && std::isfinite(result.xy.y)) out[i] = {result.xy.x, result.xy.y};
    proj_errno_reset(way);
  }
  giveBack(name, std::move(transform));
  return out;
}

std::vector<glm::dvec2> Geographic::crsFromGeographic(std::span<const glm::dvec2> degrees) {
  return transformed(kDegrees, degrees, true);
}
std::vector<glm::dvec2> Geographic::geographicFromCrs(std::span<const glm::dvec2> crs) {
  return transformed(kDegrees, crs, false);
}
std::vector<glm::dvec2> Geographic::crsFrom(const std::string& name, std::span<const glm::dvec2> places) {
  return transformed(name, places, true);
}

std::optional<glm::dvec2> Geographic::crsFromGeographic(glm::dvec2 degrees) {
  const glm::dvec2 out = crsFromGeographic(std::span(&degrees, 1)).front();
  return std::isnan(out.x) ? std::nullopt : std::optional(out);
}

std::optional<std::vector<double>> Geographic::metersAlong(std::span<const glm::dvec2> cornersCrs) {
  auto transform = take(kDegrees);
  std::vector<double> out;
  const auto measure = [&] {
    if (transform->toOwnDegrees == nullptr) return false;
    std::optional<PJ_COORD> last;
    double length = 0.0;
    const auto goTo = [&](glm::dvec2 crs) {
      const PJ_COORD there =
          proj_trans(transform->toOwnDegrees, PJ_FWD, proj_coord(crs.x, crs.y, 0.0, HUGE_VAL));
      if (!std::isfinite(there.lp.lam) || !std::isfinite(there.lp.phi)) return false;
      double leg = 0.0;
      if (last)
        geod_inverse(&transform->ellipsoid, last->lp.phi, last->lp.lam, there.lp.phi, there.lp.lam, &leg,
                     nullptr, nullptr);
      length += leg;
      last = there;
      return std::isfinite(length);
    };
    for (size_t i = 0; i < cornersCrs.size(); ++i) {
      if (i > 0) {
        const glm::dvec2 way = cornersCrs[i] - cornersCrs[i - 1];
        // In the CRS's unit: feet make for shorter parts.
        const double parts = std::clamp(std::ceil(std::hypot(way.x, way.y) / kPartMeters), 1.0, kMostParts);
        for (double k = 1.0; k < parts; k += 1.0)
          if (!goTo(cornersCrs[i - 1] + k / parts * way)) return false;
      }
      if (!goTo(cornersCrs[i])) return false;
      out.push_back(length);
    }
    return true;
  };
  const bool isKnown = measure();
  if (transform->toOwnDegrees != nullptr) proj_errno_reset(transform->toOwnDegrees);
  giveBack(kDegrees, std::move(transform));
  if (!isKnown) return std::nullopt;
  return out;
}

bool Geographic::available(const std::string& name) {
  auto transform = take(name);
  const bool there = transform->transform != nullptr;
  giveBack(name, std::move(transform));
  return there;
}

}  // namespace terrane::serve
