#include "input_crs.h"

#include <cpl_conv.h>
#include <gdal_alg.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

namespace terrane {
namespace {

constexpr double kUtmNorth = 84.0;
constexpr double kUtmSouth = -80.0;
// Half-width of what one zone's projection may cover; scale is off by a seventh there.
constexpr double kWidestFromMeridian = 30.0;

bool isUnnamed(const std::string& name) {
  return name.empty() || name == "unknown" || name == "unnamed";
}

bool isEarth(const OGRSpatialReference& crs) {
  const double axis = crs.GetSemiMajor();
  return axis > 6.3e6 && axis < 6.45e6;
}

// The geographic CRS under a projected one, or itself.
OGRSpatialReference geographicOf(const OGRSpatialReference& crs) {
  OGRSpatialReference geographic;
  geographic.CopyGeogCSFrom(&crs);
  geographic.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return geographic;
}

struct DegreeBox {
  double west = 0.0;
  double east = 0.0;
  double south = 0.0;
  double north = 0.0;
};

// Longitudes and latitudes of a raster's outline; longitudes lie within 180 degrees of
// `nearLongitude`, where there is one.
std::optional<DegreeBox> outlineInDegrees(const InputRaster& raster, const OGRSpatialReference& geographic,
                                          const double* nearLongitude) {
  constexpr int kSteps = 16;
  std::vector<double> x;
  std::vector<double> y;
  const auto& g = raster.geoTransform;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const double col = raster.width * (static_cast<double>(i) / kSteps);
      const double row = raster.height * (static_cast<double>(j) / kSteps);
      x.push_back(g[0] + col * g[1] + row * g[2]);
      y.push_back(g[3] + col * g[4] + row * g[5]);
    }
  }
  if (!sameCrs(raster.crs, geographic)) {
    const std::unique_ptr<OGRCoordinateTransformation> transform(
        OGRCreateCoordinateTransformation(&raster.crs, &geographic));
    if (!transform) return std::nullopt;
    std::vector<int> good(x.size());
    transform->Transform(static_cast<int>(x.size()), x.data(), y.data(), nullptr, good.data());
    for (size_t i = x.size(); i-- > 0;) {
      if (!good[i] || !std::isfinite(x[i]) || !std::isfinite(y[i])) {
        x.erase(x.begin() + static_cast<ptrdiff_t>(i));
        y.erase(y.begin() + static_cast<ptrdiff_t>(i));
      }
    }
    if (x.empty()) return std::nullopt;
  }
  const double center = nearLongitude ? *nearLongitude : x[x.size() / 2];
  for (double& longitude : x) longitude -= 360.0 * std::round((longitude - center) / 360.0);
  const auto [west, east] = std::minmax_element(x.begin(), x.end());
  const auto [south, north] = std::minmax_element(y.begin(), y.end());
  return DegreeBox{*west, *east, *south, *north};
}

Result<OGRSpatialReference> zoneFor(std::span<const InputRaster> inputs) {
  // The zone stands on the inputs' own datum where they share one, so that nothing is shifted.
  OGRSpatialReference geographic = geographicOf(inputs.front().crs);
  const bool shared = std::all_of(inputs.begin(), inputs.end(), [&](const InputRaster& input) {
    return sameCrs(geographicOf(input.crs), geographic);
  });
  const bool earth = isEarth(inputs.front().crs);
  for (const auto& input : inputs) {
    if (isEarth(input.crs) != earth) {
      return makeError("{} and {} lie on different celestial bodies; build them apart", inputs.front().path,
                       input.path);
    }
  }
  if (!shared) {
    if (!earth)
      return makeError(
          "the inputs have different CRSs and none is on Earth; pass --crs with a projected CRS");
    geographic.importFromEPSG(4326);
    geographic.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  }

  std::optional<DegreeBox> box;
  for (const auto& input : inputs) {
    if (!input.hasGeoTransform) continue;
    const double middle = box ? (box->west + box->east) / 2 : 0.0;
    const auto outline = outlineInDegrees(input, geographic, box ? &middle : nullptr);
    if (!outline)
      return makeError("{}: its place on Earth cannot be computed from its CRS; pass --crs or --source-crs",
                       input.path);
    box = !box ? *outline
               : DegreeBox{std::min(box->west, outline->west), std::max(box->east, outline->east),
                           std::min(box->south, outline->south), std::max(box->north, outline->north)};
  }
  if (!box)
    return makeError("{}: placed by control points only; pass --crs with a projected CRS",
                     inputs.front().path);
  double longitude = (box->west + box->east) / 2;
  longitude -= 360.0 * std::floor((longitude + 180.0) / 360.0);
  const double latitude = (box->south + box->north) / 2;
  if (latitude < -90.001 || latitude > 90.001) {
    return makeError("{}: its latitudes go to {:.6g}; is its CRS right? pass --source-crs",
                     inputs.front().path, latitude > 0 ? box->north : box->south);
  }

  OGRSpatialReference crs;
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const bool north = latitude >= 0.0;
  const int zone = std::clamp(static_cast<int>(std::floor((longitude + 180.0) / 6.0)) + 1, 1, 60);
  const bool polar = latitude > kUtmNorth || latitude < kUtmSouth;
  const char* geographicName = geographic.GetName();
  const std::string body =
      isUnnamed(geographicName != nullptr ? geographicName : "") ? "this body" : geographicName;
  if (!polar) {
    const double meridian = earth ? zone * 6 - 183.0 : std::round(longitude);
    const double reach =
        std::max(std::abs(box->west - meridian - 360.0 * std::round((box->west - meridian) / 360.0)),
                 std::abs(box->east - meridian - 360.0 * std::round((box->east - meridian) / 360.0)));
    if (reach > kWidestFromMeridian || box->east - box->west > 2.0 * kWidestFromMeridian) {
      return makeError(
          "the inputs span {:.0f} degrees of longitude, too wide for one UTM zone; pass --crs with a "
          "projected "
          "CRS, for example EPSG:3857",
          box->east - box->west);
    }
    if (!earth) {
      crs.SetProjCS(fmt::format("{} / Transverse Mercator {:g}", body, meridian).c_str());
      crs.CopyGeogCSFrom(&geographic);
      crs.SetTM(0.0, meridian, 1.0, 0.0, 0.0);
      return crs;
    }
    OGRSpatialReference wgs84;
    wgs84.importFromEPSG(4326);
    wgs84.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    if (sameCrs(geographic, wgs84)) {
      crs.importFromEPSG((north ? 32600 : 32700) + zone);
    } else {
      crs.SetProjCS(fmt::format("{} / UTM zone {}{}", body, zone, north ? 'N' : 'S').c_str());
      crs.CopyGeogCSFrom(&geographic);
      crs.SetUTM(zone, north);
      crs.AutoIdentifyEPSG();
    }
    return crs;
  }
  if (earth) {
    crs.importFromEPSG(north ? 32661 : 32761);
  } else {
    crs.SetProjCS(fmt::format("{} / Polar Stereographic {}", body, north ? "North" : "South").c_str());
    crs.CopyGeogCSFrom(&geographic);
    crs.SetPS(north ? 90.0 : -90.0, 0.0, 1.0, 0.0, 0.0);
  }
  return crs;
}

// x must grow east and y north; polar projections have axes along meridians instead.
Status checkAxes(const OGRSpatialReference& crs, const std::string& who) {
  for (int axis = 0; axis < 2; ++axis) {
    OGRAxisOrientation orientation = OAO_Other;
    if (crs.GetAxis("PROJCS", axis, &orientation) == nullptr) continue;
    if (orientation == OAO_West) {
      return makeError(
          "{}: its axes point west or south ({}); pass --crs with a variant whose axes point east and north",
          who, crs.GetName());
    }
  }
  return {};
}

}  // namespace

Result<OGRSpatialReference> crsFromUser(const std::string& text, const std::string& option) {
  const GdalMessages messages;
  OGRSpatialReference crs;
  if (crs.SetFromUserInput(text.c_str()) != OGRERR_NONE || crs.IsEmpty()) {
    return makeError("{} {}: not a CRS that PROJ knows ({}); write it like EPSG:32632", option, text,
                     messages.reason("not recognised"));
  }
  if (crs.IsCompound()) crs.StripVertical();
  if (crs.GetAxesCount() == 3) crs.DemoteTo2D(nullptr);
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  if (!crs.IsProjected() && !crs.IsGeographic()) {
    return makeError("{} {}: neither projected nor geographic; write it like EPSG:32632", option, text);
  }
  return crs;
}

bool sameCrs(const OGRSpatialReference& a, const OGRSpatialReference& b) {
  static const char* const kOptions[] = {"IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES", "CRITERION=EQUIVALENT",
                                         nullptr};
  const GdalMessages messages;
  return a.IsSame(&b, kOptions) != 0;
}

Result<OGRSpatialReference> chooseCrs(const std::string& crs, std::span<const InputRaster> inputs) {
  const GdalMessages messages;
  if (!crs.empty()) {
    TERRANE_ASSIGN(OGRSpatialReference chosen, crsFromUser(crs, "--crs"));
    if (!chosen.IsProjected()) {
      return makeError(
          "--crs {}: geographic, its units are degrees; a dataset needs a projected CRS, for example "
          "EPSG:32632 (leave --crs away for the best UTM zone)",
          crs);
    }
    TERRANE_TRY(checkAxes(chosen, "--crs " + crs));
    return chosen;
  }

  // The inputs' own, if there is just one and it is projected.
  const OGRSpatialReference& first = inputs.front().crs;
  const bool one = first.IsProjected() != 0 &&
                   std::all_of(inputs.begin(), inputs.end(),
                               [&](const InputRaster& input) { return sameCrs(input.crs, first); });
  if (!one) return zoneFor(inputs);
  TERRANE_TRY(checkAxes(first, inputs.front().path));
  return first;
}

std::optional<Stretch> stretchAt(const OGRSpatialReference& crs, double x, double y) {
  constexpr double kStepMeters = 100.0;
  constexpr double kRadians = 0.017453292519943295;
  const GdalMessages messages;
  const OGRSpatialReference geographic = geographicOf(crs);
  const std::unique_ptr<OGRCoordinateTransformation> transform(
      OGRCreateCoordinateTransformation(&crs, &geographic));
  const double unit = crs.GetLinearUnits();
  if (!transform || !(unit > 0.0)) return std::nullopt;
  const double step = kStepMeters / unit;
  std::array<double, 4> xs = {x - step, x + step, x, x}, ys = {y, y, y - step, y + step};
  if (transform->Transform(4, xs.data(), ys.data()) == FALSE) return std::nullopt;

  // So near each other that the ellipsoid's two radii of curvature are all that counts.
  const double a = geographic.GetSemiMajor(), flattening = 1.0 / geographic.GetInvFlattening();
  const double squared = std::isfinite(flattening) ? flattening * (2.0 - flattening) : 0.0;
  const double sine = std::sin(kRadians * 0.5 * (ys[2] + ys[3]));
  const double root = std::sqrt(1.0 - squared * sine * sine);
  const double alongParallel = a / root * std::sqrt(1.0 - sine * sine);
  const double alongMeridian = a * (1.0 - squared) / (root * root * root);
  const auto stretch = [&](size_t i) {
    const double longitude = std::remainder(xs[i + 1] - xs[i], 360.0);
    return 2.0 * kStepMeters /
           std::hypot(alongParallel * kRadians * longitude, alongMeridian * kRadians * (ys[i + 1] - ys[i]));
  };
  const Stretch out{stretch(0), stretch(2)};
  if (!std::isfinite(out.east) || !std::isfinite(out.north)) return std::nullopt;
  return out;
}

std::string crsDisplayName(const OGRSpatialReference& crs) {
  const GdalMessages messages;
  const char* name = crs.GetName();
  if (name != nullptr && !isUnnamed(name)) return name;

  // Nameless: perhaps it is a known one, else tell its projection and its body.
  const char* geographic = crs.GetAttrValue("GEOGCS");
  const std::string base = geographic != nullptr && !isUnnamed(geographic) ? geographic : "";
  int north = 0;
  if (const int zone = crs.GetUTMZone(&north); zone != 0 && !base.empty()) {
    return fmt::format("{} / UTM zone {}{}", base, zone, north ? 'N' : 'S');
  }
  const std::unique_ptr<OGRSpatialReference, void (*)(OGRSpatialReference*)> match(
      crs.FindBestMatch(90, "EPSG", nullptr), [](OGRSpatialReference* srs) {
        if (srs != nullptr) srs->Release();
      });
  if (match && match->GetName() != nullptr && !isUnnamed(match->GetName())) return match->GetName();
  const char* projection = crs.GetAttrValue("PROJECTION");
  std::string text = projection != nullptr ? projection : "projected";
  std::replace(text.begin(), text.end(), '_', ' ');
  if (!base.empty()) return text + " on " + base;
  if (!isEarth(crs)) return fmt::format("{} on a body of radius {:.0f} m", text, crs.GetSemiMajor());
  return text;
}

std::string crsWkt(const OGRSpatialReference& crs) {
  static const char* const kOptions[] = {"FORMAT=WKT2_2019", "MULTILINE=NO", nullptr};
  const GdalMessages messages;
  char* text = nullptr;
  std::string wkt;
  if (crs.exportToWkt(&text, kOptions) == OGRERR_NONE && text != nullptr) wkt = text;
  CPLFree(text);
  return wkt;
}

}  // namespace terrane
