#include "terrane/bake/vector_file.h"

#include <fmt/format.h>
#include <ogr_featurestyle.h>
#include <ogr_spatialref.h>
#include <ogrsf_frmts.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <memory>
#include <utility>

#include "input_crs.h"
#include "input_gdal.h"

namespace terrane {
namespace {

struct TransformationDeleter {
  void operator()(OGRCoordinateTransformation* one) const { OGRCoordinateTransformation::DestroyCT(one); }
};
using Transformation = std::unique_ptr<OGRCoordinateTransformation, TransformationDeleter>;

Result<GdalDataset> openVectors(const std::string& path) {
  registerGdal();
  const GdalMessages messages;
  GdalDataset dataset(
      GDALDataset::Open(path.c_str(), GDAL_OF_VECTOR | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR));
  if (dataset) return dataset;
  VSIStatBufL stat;
  if (VSIStatL(path.c_str(), &stat) != 0) return makeError("{}: cannot be read; does it exist?", path);
  return makeError("{}: not a vector file that GDAL can open ({}); check it with ogrinfo", path,
                   messages.reason("unknown format"));
}

// One layer, read into lines.
class LayerReader {
 public:
  LayerReader(const std::string& path, OGRLayer& layer, const VectorWindow& window,
              OGRSpatialReference target, std::vector<VectorLine>& lines)
      : path_(path), layer_(layer), window_(window), target_(std::move(target)), lines_(lines) {}

  /// What the layer covers, for who wonders why nothing came of it; empty where it is empty.
  const std::string& lies() const { return lies_; }

  Status read() {
    OGREnvelope extent;
    if (layer_.GetExtent(&extent, TRUE) != OGRERR_NONE) return {};  // nothing in it
    const OGRSpatialReference* own = chooseOwn(extent);
    lies_ = fmt::format("{:.9g} to {:.9g}, {:.9g} to {:.9g} in {}", extent.MinX, extent.MaxX, extent.MinY,
                        extent.MaxY, own == nullptr ? "a CRS that it does not name" : crsDisplayName(*own));
    if (own != nullptr && !sameCrs(*own, target_))
      TERRANE_TRY(prepareTransformation(*own));
    else
      layer_.SetSpatialFilterRect(window_.west, window_.south, window_.east, window_.north);
    layer_.ResetReading();
    while (true) {
      const OGRFeatureUniquePtr feature(layer_.GetNextFeature());
      if (!feature) return {};
      addFeature(*feature);
    }
  }

 private:
  // The layer's CRS; null where its coordinates are to be taken as they are. What GDAL assumes of GeoJSON
  // that says nothing, degrees, is not so where they are none.
  const OGRSpatialReference* chooseOwn(const OGREnvelope& extent) {
    const OGRSpatialReference* named = layer_.GetSpatialRef();
    if (named == nullptr) return nullptr;
    const bool areDegrees =
        extent.MinX >= -360.0 && extent.MaxX <= 360.0 && extent.MinY >= -90.0 && extent.MaxY <= 90.0;
    if (named->IsGeographic() && !areDegrees) return nullptr;
    own_ = *named;
    own_.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    // Longitude and latitude are those of the dataset's body.
    const std::unique_ptr<OGRSpatialReference> degrees(target_.CloneGeogCS());
    const auto radius = [](const OGRSpatialReference& crs) { return crs.GetSemiMajor(); };
    if (own_.IsGeographic() && degrees && std::abs(radius(*degrees) / radius(own_) - 1.0) > 0.01 &&
        std::abs(radius(own_) - SRS_WGS84_SEMIMAJOR) < 1.0) {
      own_ = *degrees;
      own_.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    }
    return &own_;
  }

  Status prepareTransformation(const OGRSpatialReference& own) {
    const GdalMessages messages;
    transformation_.reset(OGRCreateCoordinateTransformation(&own, &target_));
    const Transformation back(OGRCreateCoordinateTransformation(&target_, &own));
    if (!transformation_ || !back) {
      return makeError("{}: layer '{}' in {} cannot be brought into the dataset's CRS ({})", path_,
                       layer_.GetName(), crsDisplayName(own), messages.reason("no transformation"));
    }
    // Only what comes near is read. note: a window over a pole or the antimeridian has no rectangle there.
    double west, south, east, north;
    constexpr int kPointsASide = 21;
    if (back->TransformBounds(window_.west, window_.south, window_.east, window_.north, &west, &south, &east,
                              &north, kPointsASide) &&
        west < east && south < north) {
      layer_.SetSpatialFilterRect(west, south, east, north);
    }
    return {};
  }

  void addFeature(OGRFeature& feature) {
    const OGRGeometry* geometry = feature.GetGeometryRef();
    if (geometry == nullptr) return;
    VectorLine line;
    readStyle(feature, line);
    if (geometry->hasCurveGeometry()) {
      const std::unique_ptr<OGRGeometry> straight(geometry->getLinearGeometry());
      if (straight) add(*straight, line);
    } else {
      add(*geometry, line);
    }
  }

  void add(const OGRGeometry& geometry, const VectorLine& style) {
    switch (wkbFlatten(geometry.getGeometryType())) {
      case wkbPoint:
        if (!geometry.IsEmpty())
          addCorners({{geometry.toPoint()->getX(), geometry.toPoint()->getY()}}, style);
        return;
      case wkbLineString: {
        const OGRLineString& line = *geometry.toLineString();
        std::vector<glm::dvec2> corners;
        corners.reserve(static_cast<size_t>(line.getNumPoints()));
        for (int i = 0; i < line.getNumPoints(); ++i) corners.emplace_back(line.getX(i), line.getY(i));
        addCorners(std::move(corners), style);
        return;
      }
      case wkbPolygon:
      case wkbTriangle:
        for (const OGRLinearRing* ring : *geometry.toPolygon()) add(*ring, style);
        return;
      case wkbMultiPoint:
      case wkbMultiLineString:
      case wkbMultiPolygon:
      case wkbGeometryCollection:
        for (const OGRGeometry* part : *geometry.toGeometryCollection()) add(*part, style);
        return;
      default:  // solids and surfaces have no outline of their own
        return;
    }
  }

  // Brings corners into the window's CRS. A line is cut where a corner has no place there, and gets more
  // corners where what is straight in its own CRS is not in this one.
  void addCorners(std::vector<glm::dvec2> corners, const VectorLine& style) {
    const GdalMessages quiet;
    VectorLine line = style;
    const auto end = [&] {
      if (comesIn(line.corners)) lines_.push_back(line);
      line.corners.clear();
    };
    std::optional<glm::dvec2> before;
    for (size_t i = 0; i < corners.size(); ++i) {
      const std::optional<glm::dvec2> place = placeOf(corners[i]);
      if (!place)
        end();
      else if (before && !line.corners.empty())
        addBetween(corners[i - 1], *before, corners[i], *place, 0, line.corners);
      if (place) line.corners.push_back(*place);
      before = place;
    }
    end();
  }

  std::optional<glm::dvec2> placeOf(glm::dvec2 corner) const {
    const bool isGood = !transformation_ || transformation_->Transform(1, &corner.x, &corner.y) != 0;
    if (!isGood || !std::isfinite(corner.x) || !std::isfinite(corner.y)) return std::nullopt;
    return corner;
  }

  // What lies between two corners, so that no leg is farther from the line than hardly anybody sees.
  void addBetween(glm::dvec2 from, glm::dvec2 fromPlace, glm::dvec2 to, glm::dvec2 toPlace, int depth,
                  std::vector<glm::dvec2>& out) const {
    constexpr int kDeepest = 12;
    constexpr double kOff = 1e-5;  // of the window's diagonal
    if (!transformation_ || depth == kDeepest) return;
    const glm::dvec2 middle = 0.5 * (from + to);
    const std::optional<glm::dvec2> place = placeOf(middle);
    const double off = kOff * std::hypot(window_.east - window_.west, window_.north - window_.south);
    if (!place || glm::distance(*place, 0.5 * (fromPlace + toPlace)) <= off) return;
    addBetween(from, fromPlace, middle, *place, depth + 1, out);
    out.push_back(*place);
    addBetween(middle, *place, to, toPlace, depth + 1, out);
  }

  bool comesIn(const std::vector<glm::dvec2>& corners) const {
    if (corners.empty()) return false;
    glm::dvec2 low = corners.front();
    glm::dvec2 high = corners.front();
    for (const glm::dvec2& corner : corners) {
      low = glm::min(low, corner);
      high = glm::max(high, corner);
    }
    return low.x <= window_.east && high.x >= window_.west && low.y <= window_.north &&
           high.y >= window_.south;
  }

  // What is no style, but has its name, is left alone.
  static void readStyle(OGRFeature& feature, VectorLine& line) {
    const auto field = [&](const char* name) {
      const int i = feature.GetFieldIndex(name);
      return i >= 0 && feature.IsFieldSetAndNotNull(i) ? i : -1;
    };
    for (const char* name : {"color", "stroke"}) {
      if (const int i = field(name); i >= 0) line.stroke = feature.GetFieldAsString(i);
    }
    const auto number = [&](const char* name) -> std::optional<double> {
      const int i = field(name);
      if (i < 0) return std::nullopt;
      const char* text = feature.GetFieldAsString(i);
      const double value = CPLAtof(text);
      if (CPLGetValueType(text) == CPL_VALUE_STRING || !(value > 0.0 && value <= 1e6)) return std::nullopt;
      return value;
    };
    line.strokeOpacity = number("stroke-opacity");
    line.strokePixels = number("stroke-width");
    // note: names of attributes in shapefiles have ten letters.
    if (!line.strokePixels) line.strokePixels = number("stroke-wid");
    line.strokeMeters = number("stroke-meters");
    if (line.stroke.empty() && !line.strokeOpacity && !line.strokePixels && !line.strokeMeters)
      readPen(feature, line);
  }

  // What formats with a style of their own (KML, DXF, ...) say.
  static void readPen(OGRFeature& feature, VectorLine& line) {
    const GdalMessages quiet;
    OGRStyleMgr manager;
    if (feature.GetStyleString() == nullptr || manager.InitFromFeature(&feature) == nullptr) return;
    for (int i = 0; i < manager.GetPartCount(); ++i) {
      const std::unique_ptr<OGRStyleTool> part(manager.GetPart(i));
      if (!part || part->GetType() != OGRSTCPen) continue;
      auto& pen = static_cast<OGRStylePen&>(*part);
      pen.SetUnit(OGRSTUPixel);
      GBool isDefault = TRUE;
      if (const char* color = pen.Color(isDefault); !isDefault && color != nullptr) {
        int red = 0, green = 0, blue = 0, alpha = 255;
        if (pen.GetRGBFromString(color, red, green, blue, alpha)) {
          line.stroke = fmt::format("#{:02x}{:02x}{:02x}", red & 255, green & 255, blue & 255);
          if (alpha > 0 && alpha < 255) line.strokeOpacity = alpha / 255.0;
        }
      }
      if (const double width = pen.Width(isDefault); !isDefault && width > 0.0) line.strokePixels = width;
      return;
    }
  }

  const std::string& path_;
  OGRLayer& layer_;
  const VectorWindow& window_;
  OGRSpatialReference target_;
  OGRSpatialReference own_;
  Transformation transformation_;
  std::string lies_;
  std::vector<VectorLine>& lines_;
};

}  // namespace

Result<std::vector<VectorLine>> readVectorLines(const std::string& path, const VectorWindow& window) {
  TERRANE_ASSIGN(const GdalDataset dataset, openVectors(path));
  TERRANE_ASSIGN(const OGRSpatialReference target, crsFromUser(window.crsWkt, "the dataset's CRS"));

  // What makes up tracks and routes is drawn as these.
  const bool isGpx = dataset->GetDriver() != nullptr && EQUAL(dataset->GetDriver()->GetDescription(), "GPX");
  std::vector<VectorLine> lines;
  std::string lies;
  const GdalMessages messages;
  for (OGRLayer* layer : dataset->GetLayers()) {
    if (isGpx && (EQUAL(layer->GetName(), "track_points") || EQUAL(layer->GetName(), "route_points")))
      continue;
    LayerReader reader(path, *layer, window, target, lines);
    TERRANE_TRY(reader.read());
    if (!reader.lies().empty()) lies = reader.lies();
  }
  if (!messages.errors().empty())
    return makeError("{}: is damaged ({}); check it with ogrinfo -al", path, messages.errors().front());
  if (lies.empty()) return makeError("{}: has no lines, areas or points", path);
  if (lines.empty()) {
    return makeError(
        "{}: nothing of it lies on the dataset: it covers {}, the dataset {:.9g} to {:.9g}, {:.9g} to {:.9g} "
        "in {}",
        path, lies, window.west, window.east, window.south, window.north, crsDisplayName(target));
  }
  return lines;
}

}  // namespace terrane
