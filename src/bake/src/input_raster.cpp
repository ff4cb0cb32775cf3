#include "input_raster.h"

#include <cpl_string.h>
#include <cpl_vsi.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

namespace terrane {
namespace {

// No ground is that high; files that say so mean "none" without declaring it.
constexpr double kAbsurdHeight = 1e30;

struct IntegerRange {
  double low;
  double high;
};

std::optional<IntegerRange> integerRange(GDALDataType type) {
  switch (type) {
    case GDT_Byte:
      return IntegerRange{0.0, 255.0};
    case GDT_UInt16:
      return IntegerRange{0.0, 65535.0};
    case GDT_Int16:
      return IntegerRange{-32768.0, 32767.0};
    case GDT_UInt32:
      return IntegerRange{0.0, 4294967295.0};
    case GDT_Int32:
      return IntegerRange{-2147483648.0, 2147483647.0};
    case GDT_UInt64:
      return IntegerRange{0.0, 18446744073709551615.0};
    case GDT_Int64:
      return IntegerRange{-9223372036854775808.0, 9223372036854775807.0};
    default:
      return std::nullopt;
  }
}

std::optional<double> declaredNoData(GDALRasterBand& band, GDALDataType type) {
  int has = 0;
  if (type == GDT_Int64) {
    const auto value = static_cast<double>(band.GetNoDataValueAsInt64(&has));
    return has ? std::optional<double>(value) : std::nullopt;
  }
  if (type == GDT_UInt64) {
    const auto value = static_cast<double>(band.GetNoDataValueAsUInt64(&has));
    return has ? std::optional<double>(value) : std::nullopt;
  }
  const double value = band.GetNoDataValue(&has);
  return has ? std::optional<double>(value) : std::nullopt;
}

// The value as the band's type holds it, or nothing.
std::optional<double> noDataInType(double value, GDALDataType type) {
  const auto range = integerRange(type);
  if (range) {
    if (!(value >= range->low && value <= range->high) || value != std::floor(value)) return std::nullopt;
    return value;
  }
  if (type != GDT_Float32 || !std::isfinite(value)) return value;

  // note: -3.40282347e+38 written with too few digits is often a hair beyond what a float holds.
  constexpr double kMax = std::numeric_limits<float>::max();
  if (std::abs(value) > kMax * 1.00001) return std::nullopt;
  return static_cast<float>(std::clamp(value, -kMax, kMax));
}

bool isPicture(GDALDataset& dataset, GDALRasterBand& band) {
  return dataset.GetRasterCount() >= 3 && band.GetRasterDataType() == GDT_Byte &&
         band.GetColorInterpretation() == GCI_RedBand;
}

// The horizontal part of the file's CRS, and what it says of heights.
void describeCrs(const OGRSpatialReference* crs, InputRaster& raster, double& crsHeightUnit) {
  if (crs == nullptr || crs->IsEmpty() || crs->IsLocal()) return;
  raster.crs = *crs;
  raster.crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  if (raster.crs.IsCompound()) {
    const char* datum = raster.crs.GetAttrValue("COMPD_CS|VERT_CS");
    if (datum != nullptr) raster.verticalDatum = datum;
    const double unit = raster.crs.GetTargetLinearUnits("COMPD_CS|VERT_CS", nullptr);
    if (unit > 0.0) crsHeightUnit = unit;
    // "NAVD88 height (ftUS)": the datum stays, the unit does not, since heights become metres.
    std::string& name = raster.verticalDatum;
    if (unit != 1.0 && name.ends_with(')') && name.rfind(" (") != std::string::npos)
      name.erase(name.rfind(" ("));
    raster.crs.StripVertical();
  } else if (raster.crs.GetAxesCount() == 3) {
    raster.crs.DemoteTo2D(nullptr);
  }
}

}  // namespace

std::optional<double> metersFromUnitName(const std::string& name) {
  // Spellings differ in case, spaces and dots only.
  std::string key;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)))
      key += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  const auto any = [&](std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(), [&](const char* n) { return key == n; });
  };
  if (any({"", "m", "metre", "meter", "metres", "meters", "mtr", "unknown", "none"})) return 1.0;
  if (any({"ft", "foot", "feet", "internationalfoot", "internationalfeet", "ftint", "ift",
           "footinternational"}))
    return 0.3048;
  if (any({"usft", "ftus", "ussurveyfoot", "ussurveyfeet", "footus", "feetus", "surveyfoot", "surveyfeet",
           "sft", "usfoot", "usfeet", "ussurvey", "ussurveyft", "footussurvey"})) {
    return 1200.0 / 3937.0;
  }
  if (any({"mm", "millimetre", "millimeter", "millimetres", "millimeters"})) return 0.001;
  if (any({"cm", "centimetre", "centimeter", "centimetres", "centimeters"})) return 0.01;
  if (any({"dm", "decimetre", "decimeter", "decimetres", "decimeters"})) return 0.1;
  if (any({"km", "kilometre", "kilometer", "kilometres", "kilometers"})) return 1000.0;
  if (any({"yd", "yard", "yards"})) return 0.9144;
  return std::nullopt;
}

bool InputRaster::isVoid(double raw) const {
  if (!(std::abs(raw) < kAbsurdHeight)) return true;
  if (!noData) return false;
  if (raw == *noData) return true;
  if (type != GDT_Float32) return false;

  // Floats compare as GDAL compares them, two steps apart being equal.
  const auto a = static_cast<float>(raw);
  const auto b = static_cast<float>(*noData);
  return std::abs(a - b) < std::numeric_limits<float>::epsilon() * std::abs(a + b) * 2.0F;
}

std::string InputRaster::voidText() const {
  std::string text = noData ? fmt::format("{}", *noData) : std::string();
  if (mask) text += text.empty() ? "mask" : ", mask";
  return text;
}

Result<InputRaster> describeRaster(const InputPath& input, const std::optional<double>& noData) {
  TERRANE_ASSIGN(const GdalDataset dataset, openRaster(input.path));
  const GdalMessages messages;
  InputRaster raster;
  raster.path = input.path;
  raster.name = std::filesystem::path(input.path).filename().string();

  // A container of several rasters must be told which one.
  if (dataset->GetRasterCount() == 0) {
    const char* first = CSLFetchNameValue(dataset->GetMetadata("SUBDATASETS"), "SUBDATASET_1_NAME");
    if (first == nullptr) return makeError("{}: holds no raster band; name a raster", input.path);
    return makeError("{}: holds several rasters; name one of them, for example '{}' (gdalinfo lists them)",
                     input.path, first);
  }
  GDALRasterBand& band = *dataset->GetRasterBand(1);
  raster.width = band.GetXSize();
  raster.height = band.GetYSize();
  raster.type = band.GetRasterDataType();
  raster.integer = integerRange(raster.type).has_value();
  raster.imageLike = isPicture(*dataset, band);
  if (GDALDataTypeIsComplex(raster.type)) {
    return makeError("{}: its values are complex numbers, not heights; convert it to one real band first",
                     input.path);
  }
  if (band.GetColorTable() != nullptr || band.GetColorInterpretation() == GCI_PaletteIndex) {
    return makeError(
        "{}: its values are indices into a colour palette, not heights; name the elevation raster itself",
        input.path);
  }
  const char* pixelType = band.GetMetadataItem("PIXELTYPE", "IMAGE_STRUCTURE");
  if (pixelType != nullptr && EQUAL(pixelType, "SIGNEDBYTE")) {
    return makeError("{}: signed bytes are not read; convert it with gdal_translate -ot Int16", input.path);
  }
  if (raster.width < 2 || raster.height < 2) {
    return makeError(
        "{}: {} x {} pixels are too few, terrain needs at least 2 x 2 samples; name a larger raster",
        input.path, raster.width, raster.height);
  }

  // Where it lies: a transform, else control points, which only a warp can follow.
  double crsHeightUnit = 0.0;
  raster.hasGeoTransform = dataset->GetGeoTransform(raster.geoTransform.data()) == CE_None;
  if (raster.hasGeoTransform) {
    describeCrs(dataset->GetSpatialRef(), raster, crsHeightUnit);
    const auto& g = raster.geoTransform;
    const double area = g[1] * g[5] - g[2] * g[4];
    if (!std::isfinite(area) || area == 0.0 || !std::isfinite(g[0]) || !std::isfinite(g[3])) {
      return makeError("{}: its georeferencing is degenerate (pixels without area); repair it with gdal_edit",
                       input.path);
    }
  } else if (dataset->GetGCPCount() >= 3) {
    describeCrs(dataset->GetGCPSpatialRef(), raster, crsHeightUnit);
  } else {
    return makeError(
        "{}: does not say where it lies (no geotransform, no control points); georeference it first, "
        "for example with gdal_translate -a_ullr",
        input.path);
  }

  // What its values mean: scale and offset first, then the unit.
  const std::string unitName = band.GetUnitType() != nullptr ? band.GetUnitType() : "";
  double unit = unitName.empty() && crsHeightUnit > 0.0 ? crsHeightUnit : 1.0;
  if (const auto known = metersFromUnitName(unitName); !known) {
    raster.warnings.push_back(
        fmt::format("{}: unknown height unit '{}', taken as metres; set it with gdal_edit if wrong",
                    input.path, unitName));
  } else if (!unitName.empty()) {
    unit = *known;
  }
  int hasScale = 0;
  int hasOffset = 0;
  const double scale = band.GetScale(&hasScale);
  const double offset = band.GetOffset(&hasOffset);
  raster.heightScale = (hasScale ? scale : 1.0) * unit;
  raster.heightOffset = (hasOffset ? offset : 0.0) * unit;
  if (!std::isfinite(raster.heightScale) || raster.heightScale == 0.0 ||
      !std::isfinite(raster.heightOffset)) {
    return makeError(
        "{}: its band has scale {} and offset {}, which give no heights; repair them with gdal_edit",
        input.path, scale, offset);
  }

  // What is void: the user's word, else the file's.
  const auto declared = noData ? noData : declaredNoData(band, raster.type);
  if (declared) {
    raster.noData = noDataInType(*declared, raster.type);
    if (!raster.noData) {
      raster.warnings.push_back(fmt::format("{}: nodata {} cannot occur in {} values and is ignored",
                                            input.path, *declared, GDALGetDataTypeName(raster.type)));
    }
  }
  const int maskFlags = band.GetMaskFlags();
  if (!noData && (maskFlags & (GMF_ALL_VALID | GMF_NODATA)) == 0) {
    raster.mask = true;
    for (int i = 1; (maskFlags & GMF_ALPHA) != 0 && i <= dataset->GetRasterCount(); ++i) {
      if (dataset->GetRasterBand(i)->GetColorInterpretation() == GCI_AlphaBand) raster.alphaBand = i;
    }
  }
  if (raster.imageLike && !input.fromFolder) {
    raster.warnings.push_back(
        fmt::format("{}: looks like a picture; its first band is taken as heights", input.path));
  }

  VSIStatBufL stat;
  if (VSIStatL(input.path.c_str(), &stat) == 0 && !VSI_ISDIR(stat.st_mode))
    raster.bytes = static_cast<uint64_t>(stat.st_size);
  return raster;
}

Status readHeights(GDALDataset& dataset, const InputRaster& raster, int col, int row, int cols, int rows,
                   std::span<float> heights, std::vector<double>& raw, std::vector<uint8_t>& mask) {
  const size_t count = static_cast<size_t>(cols) * static_cast<size_t>(rows);
  TERRANE_CHECK(heights.size() == count, "{} heights for {} pixels", heights.size(), count);
  const GdalMessages messages;
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  const auto fail = [&](const char* what) {
    return makeError(
        "{}: cannot read its {} at column {}, row {} ({}); the file seems damaged or cut short, copy it "
        "again",
        raster.path, what, col, row, messages.reason("read error"));
  };

  // Values that floats hold are read as such, into their place.
  const bool asFloats = raster.type == GDT_Byte || raster.type == GDT_Int16 || raster.type == GDT_UInt16 ||
                        raster.type == GDT_Float32;
  if (!asFloats) raw.resize(count);
  void* into = asFloats ? static_cast<void*>(heights.data()) : raw.data();
  // note: some drivers report a read error and still return success, with zeros in place of the data.
  if (band.RasterIO(GF_Read, col, row, cols, rows, into, cols, rows, asFloats ? GDT_Float32 : GDT_Float64, 0,
                    0, nullptr) != CE_None ||
      !messages.errors().empty()) {
    return fail("samples");
  }
  if (raster.mask) {
    mask.resize(count);
    if (band.GetMaskBand()->RasterIO(GF_Read, col, row, cols, rows, mask.data(), cols, rows, GDT_Byte, 0, 0,
                                     nullptr) != CE_None ||
        !messages.errors().empty()) {
      return fail("mask");
    }
  }

  // Most rasters need none of this but the look for absurd values.
  const bool plain =
      asFloats && !raster.noData && !raster.mask && raster.heightScale == 1.0 && raster.heightOffset == 0.0;
  if (plain) {
    for (float& height : heights) {
      const bool none = !(std::abs(height) < static_cast<float>(kAbsurdHeight));
      height = none ? std::numeric_limits<float>::quiet_NaN() : height;
    }
    return {};
  }
  for (size_t i = 0; i < count; ++i) {
    const double value = asFloats ? static_cast<double>(heights[i]) : raw[i];
    const bool none = raster.isVoid(value) || (raster.mask && mask[i] == 0);
    heights[i] =
        none ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(raster.metersFromRaw(value));
  }
  return {};
}

}  // namespace terrane
