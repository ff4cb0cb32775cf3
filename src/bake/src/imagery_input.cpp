#include "imagery_input.h"

#include <cpl_vsi.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "input_crs.h"

namespace terrane {

namespace {

/// Pixels along the longer side of the overview that a stretch is found from.
constexpr int kSampleSide = 512;

std::optional<double> noDataOf(GDALRasterBand& band, const std::optional<double>& given) {
  if (given) return given;
  int has = 0;
  const double value = band.GetNoDataValue(&has);
  return has != 0 ? std::optional<double>(value) : std::nullopt;
}

/// A value that the band's type can hold, as floats compare.
bool isNothing(float value, const std::optional<double>& noData) {
  return std::isnan(value) || (noData && value == static_cast<float>(*noData));
}

Error readError(const std::string& path, int col, int row, const GdalMessages& messages) {
  return makeError(
      "{}: cannot read its pixels at column {}, row {} ({}); the file seems damaged or cut short, copy it "
      "again",
      path, col, row, messages.reason("read error"));
}

struct OpenFiles {
  std::vector<GdalDataset> files;
  std::vector<PictureBand> bands;  ///< of all files, in order
};

Result<OpenFiles> openFiles(const std::vector<std::string>& paths, const ImageryLayerOptions& options) {
  OpenFiles out;
  for (const std::string& path : paths) {
    TERRANE_ASSIGN(GdalDataset dataset, openRaster(path));
    if (dataset->GetRasterCount() == 0)
      return makeError("{}: holds no raster band, or several rasters; name one of them (gdalinfo lists them)",
                       path);
    GDALDataset& first = out.files.empty() ? *dataset : *out.files.front();
    if (first.GetRasterXSize() != dataset->GetRasterXSize() ||
        first.GetRasterYSize() != dataset->GetRasterYSize()) {
      return makeError("{}: has another size than {}; only files on the same grid make one picture", path,
                       paths.front());
    }
    for (int i = 1; i <= dataset->GetRasterCount(); ++i) {
      out.bands.push_back(
          {static_cast<int>(out.files.size()), i, noDataOf(*dataset->GetRasterBand(i), options.noData)});
    }
    out.files.push_back(std::move(dataset));
  }
  return out;
}

/// Which bands are the colours: the user's word, else the file's, else the first ones.
Status chooseBands(const OpenFiles& open, const ImageryLayerOptions& options, PictureInput& picture) {
  const auto band = [&](const PictureBand& at) -> GDALRasterBand& {
    return *open.files[static_cast<size_t>(at.file)]->GetRasterBand(at.band);
  };
  const auto meaning = [&](GDALColorInterp wanted) -> const PictureBand* {
    for (const PictureBand& at : open.bands)
      if (band(at).GetColorInterpretation() == wanted) return &at;
    return nullptr;
  };
  if (const PictureBand* alpha = meaning(GCI_AlphaBand); alpha != nullptr) picture.alpha = *alpha;

  if (!options.bands.empty()) {
    if (options.bands.size() == 2 || options.bands.size() > 4)
      return makeError(
          "--bands: {} bands make no colour; give one (grey), three (red, green, blue) or four (and alpha)",
          options.bands.size());
    for (const int number : options.bands) {
      if (number < 1 || static_cast<size_t>(number) > open.bands.size()) {
        return makeError("{}: has no band {} (it has {}); see --bands", picture.raster.path, number,
                         open.bands.size());
      }
      picture.channels.push_back(open.bands[static_cast<size_t>(number) - 1]);
    }
    if (picture.channels.size() == 4) {
      picture.alpha = picture.channels.back();
      picture.channels.pop_back();
    }
  } else {
    const std::array<const PictureBand*, 3> colors = {meaning(GCI_RedBand), meaning(GCI_GreenBand),
                                                      meaning(GCI_BlueBand)};
    std::vector<PictureBand> opaque;
    for (const PictureBand& at : open.bands)
      if (band(at).GetColorInterpretation() != GCI_AlphaBand) opaque.push_back(at);
    if (opaque.empty()) return makeError("{}: has no band but alpha; see --bands", picture.raster.path);
    if (open.files.size() == 1 && colors[0] != nullptr && colors[1] != nullptr && colors[2] != nullptr) {
      for (const PictureBand* color : colors) picture.channels.push_back(*color);
    } else if (opaque.size() >= 3) {
      picture.channels.assign(opaque.begin(), opaque.begin() + 3);
    } else {
      picture.channels.assign(opaque.begin(), opaque.begin() + 1);
    }
  }

  // One band may be an index into colours.
  GDALRasterBand& first = band(picture.channels.front());
  if (const GDALColorTable* table = first.GetColorTable(); table != nullptr && picture.channels.size() == 1) {
    for (int i = 0; i < table->GetColorEntryCount(); ++i) {
      GDALColorEntry entry{};
      table->GetColorEntryAsRGB(i, &entry);
      const auto byte = [](short value) { return static_cast<uint8_t>(std::clamp<int>(value, 0, 255)); };
      picture.palette.push_back({byte(entry.c1), byte(entry.c2), byte(entry.c3), byte(entry.c4)});
    }
  }
  picture.bytes = true;
  for (const PictureBand& at : picture.channels) {
    if (GDALDataTypeIsComplex(band(at).GetRasterDataType()))
      return makeError("{}: its values are complex numbers, not colours; convert it first",
                       picture.raster.path);
    picture.bytes = picture.bytes && band(at).GetRasterDataType() == GDT_Byte;
  }
  const int maskFlags = first.GetMaskFlags();
  picture.mask = picture.alpha.band == 0 && !options.noData && (maskFlags & GMF_PER_DATASET) != 0 &&
                 (maskFlags & (GMF_ALL_VALID | GMF_NODATA | GMF_ALPHA)) == 0;
  return {};
}

/// Where the picture lies.
Status placePicture(GDALDataset& dataset, const ImageryLayerOptions& options, InputRaster& raster) {
  raster.width = dataset.GetRasterXSize();
  raster.height = dataset.GetRasterYSize();
  raster.hasGeoTransform = dataset.GetGeoTransform(raster.geoTransform.data()) == CE_None;
  const OGRSpatialReference* crs =
      raster.hasGeoTransform ? dataset.GetSpatialRef() : dataset.GetGCPSpatialRef();
  if (!raster.hasGeoTransform && dataset.GetGCPCount() < 3) {
    return makeError(
        "{}: does not say where it lies (no geotransform, no control points); georeference it first, for "
        "example with gdal_translate -a_ullr",
        raster.path);
  }
  const auto& g = raster.geoTransform;
  if (raster.hasGeoTransform && !(std::abs(g[1] * g[5] - g[2] * g[4]) > 0.0)) {
    return makeError("{}: its georeferencing is degenerate (pixels without area); repair it with gdal_edit",
                     raster.path);
  }
  if (!options.sourceCrs.empty()) {
    TERRANE_ASSIGN(raster.crs, crsFromUser(options.sourceCrs, "--imagery-crs"));
  } else if (crs != nullptr && !crs->IsEmpty() && !crs->IsLocal()) {
    raster.crs = *crs;
    raster.crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    if (raster.crs.IsCompound()) raster.crs.StripVertical();
  }
  if (raster.crs.IsEmpty()) {
    return makeError(
        "{}: has no CRS; pass --imagery-crs, for example --imagery-crs EPSG:4326 if it is in degrees",
        raster.path);
  }
  return {};
}

}  // namespace

std::string PictureInput::bandsText() const {
  std::string text = !palette.empty() ? "palette " : channels.size() == 1 ? "grey " : "";
  const auto add = [&](const PictureBand& band) {
    text += paths.size() > 1 ? fmt::format("{}:{}", band.file + 1, band.band) : fmt::format("{}", band.band);
  };
  for (size_t i = 0; i < channels.size(); ++i) {
    if (i > 0) text += ",";
    add(channels[i]);
  }
  if (alpha.band != 0) {
    text += " alpha ";
    add(alpha);
  } else if (mask) {
    text += " mask";
  }
  return text;
}

Result<PictureInput> describePicture(const std::vector<std::string>& paths,
                                     const ImageryLayerOptions& options) {
  TERRANE_ASSIGN(const OpenFiles open, openFiles(paths, options));
  const GdalMessages messages;
  PictureInput picture;
  picture.paths = paths;
  picture.raster.path = paths.front();
  picture.raster.name = std::filesystem::path(paths.front()).filename().string();
  TERRANE_TRY(placePicture(*open.files.front(), options, picture.raster));
  TERRANE_TRY(chooseBands(open, options, picture));

  for (size_t i = 0; i < paths.size(); ++i) {
    InputRecord& record = picture.records.emplace_back();
    record.name = std::filesystem::path(paths[i]).filename().string();
    record.width = picture.raster.width;
    record.height = picture.raster.height;
    record.dataType = GDALGetDataTypeName(open.files[i]->GetRasterBand(1)->GetRasterDataType());
    record.sourceCrs = crsWkt(picture.raster.crs);
    for (const PictureBand& channel : picture.channels) {
      if (static_cast<size_t>(channel.file) == i && channel.noData)
        record.noData = fmt::format("{}", *channel.noData);
    }
    if (picture.alpha.band != 0 && static_cast<size_t>(picture.alpha.file) == i)
      record.noData += record.noData.empty() ? "alpha" : ", alpha";
    if (picture.mask && i == 0) record.noData += record.noData.empty() ? "mask" : ", mask";
    VSIStatBufL stat;
    if (VSIStatL(paths[i].c_str(), &stat) == 0 && !VSI_ISDIR(stat.st_mode))
      record.bytes = static_cast<uint64_t>(stat.st_size);
  }
  return picture;
}

Status sampleValues(const PictureInput& picture, std::vector<std::vector<float>>& values) {
  const int width = picture.raster.width;
  const int height = picture.raster.height;
  const double shrink =
      std::max({1.0, static_cast<double>(width) / kSampleSide, static_cast<double>(height) / kSampleSide});
  const int cols = std::max(1, static_cast<int>(width / shrink));
  const int rows = std::max(1, static_cast<int>(height / shrink));
  values.resize(std::max(values.size(), picture.channels.size()));
  std::vector<float> read(static_cast<size_t>(cols) * static_cast<size_t>(rows));
  for (size_t c = 0; c < picture.channels.size(); ++c) {
    const PictureBand& at = picture.channels[c];
    TERRANE_ASSIGN(const GdalDataset dataset, openRaster(picture.paths[static_cast<size_t>(at.file)]));
    const GdalMessages messages;
    if (dataset->GetRasterBand(at.band)->RasterIO(GF_Read, 0, 0, width, height, read.data(), cols, rows,
                                                  GDT_Float32, 0, 0, nullptr) != CE_None ||
        !messages.errors().empty()) {
      return readError(picture.paths[static_cast<size_t>(at.file)], 0, 0, messages);
    }
    for (const float value : read)
      if (std::isfinite(value) && !isNothing(value, at.noData)) values[c].push_back(value);
  }
  return {};
}

Result<PictureReader> PictureReader::open(const PictureInput& picture) {
  PictureReader reader(picture);
  for (const std::string& path : picture.paths) {
    TERRANE_ASSIGN(GdalDataset dataset, openRaster(path));
    if (dataset->GetRasterXSize() != picture.raster.width ||
        dataset->GetRasterYSize() != picture.raster.height)
      return makeError("{}: changed while it was read; build again when it is at rest", path);
    reader.files_.push_back(std::move(dataset));
  }
  return reader;
}

Status PictureReader::read(int col, int row, int cols, int rows, std::vector<uint8_t>& rgba) {
  const size_t count = static_cast<size_t>(cols) * static_cast<size_t>(rows);
  rgba.resize(4 * count);
  none_.assign(count, 0);
  if (picture_->bytes && picture_->stretch.empty())
    TERRANE_TRY(readColors(col, row, cols, rows, rgba));
  else
    TERRANE_TRY(readStretched(col, row, cols, rows, rgba));
  return readAlpha(col, row, cols, rows, rgba);
}

/// 8-bit channels as they are, or through the palette.
Status PictureReader::readColors(int col, int row, int cols, int rows, std::vector<uint8_t>& rgba) {
  const GdalMessages messages;
  const size_t count = none_.size();
  const auto& channels = picture_->channels;
  for (size_t c = 0; c < channels.size(); ++c) {
    // Neighbouring bands of one file come in one call: they often lie together.
    int together = 1;
    std::array<int, 3> bands = {channels[c].band, 0, 0};
    while (c + static_cast<size_t>(together) < channels.size() &&
           channels[c + static_cast<size_t>(together)].file == channels[c].file) {
      bands[static_cast<size_t>(together)] = channels[c + static_cast<size_t>(together)].band;
      ++together;
    }
    GDALDataset& file = *files_[static_cast<size_t>(channels[c].file)];
    if (file.RasterIO(GF_Read, col, row, cols, rows, rgba.data() + c, cols, rows, GDT_Byte, together,
                      bands.data(), 4, GSpacing{4} * cols, 1, nullptr) != CE_None ||
        !messages.errors().empty()) {
      return readError(picture_->paths[static_cast<size_t>(channels[c].file)], col, row, messages);
    }
    c += static_cast<size_t>(together) - 1;
  }
  for (size_t c = 0; c < channels.size(); ++c) {
    if (!channels[c].noData) continue;
    for (size_t i = 0; i < count; ++i)
      none_[i] =
          static_cast<uint8_t>(none_[i] + (static_cast<double>(rgba[4 * i + c]) == *channels[c].noData));
  }
  // What all channels have at nodata is nothing; one alone may be a colour.
  const bool hasNoData = channels.front().noData.has_value();
  for (size_t i = 0; i < count; ++i) rgba[4 * i + 3] = hasNoData && none_[i] == channels.size() ? 0 : 255;
  if (!picture_->palette.empty()) {
    for (size_t i = 0; i < count; ++i) {
      const size_t index = rgba[4 * i];
      const uint8_t alpha = rgba[4 * i + 3];
      const auto color =
          index < picture_->palette.size() ? picture_->palette[index] : std::array<uint8_t, 4>{0, 0, 0, 0};
      std::copy(color.begin(), color.end(), rgba.begin() + static_cast<ptrdiff_t>(4 * i));
      if (alpha == 0) rgba[4 * i + 3] = 0;
    }
  } else if (channels.size() == 1) {
    for (size_t i = 0; i < count; ++i) rgba[4 * i + 1] = rgba[4 * i + 2] = rgba[4 * i];
  }
  return {};
}

/// Channels of any type between the values that are black and white.
Status PictureReader::readStretched(int col, int row, int cols, int rows, std::vector<uint8_t>& rgba) {
  const GdalMessages messages;
  const size_t count = none_.size();
  const auto& channels = picture_->channels;
  values_.resize(count);
  for (size_t c = 0; c < channels.size(); ++c) {
    if (bandOf(channels[c])
                .RasterIO(GF_Read, col, row, cols, rows, values_.data(), cols, rows, GDT_Float32, 0, 0,
                          nullptr) != CE_None ||
        !messages.errors().empty()) {
      return readError(picture_->paths[static_cast<size_t>(channels[c].file)], col, row, messages);
    }
    const auto low = static_cast<float>(picture_->stretch[c][0]);
    const auto factor = static_cast<float>(255.0 / (picture_->stretch[c][1] - picture_->stretch[c][0]));
    const std::optional<double>& noData = channels[c].noData;
    for (size_t i = 0; i < count; ++i) {
      const float value = values_[i];
      if (isNothing(value, noData)) {
        rgba[4 * i + c] = 0;
        ++none_[i];
      } else {
        rgba[4 * i + c] = static_cast<uint8_t>(std::clamp((value - low) * factor, 0.0F, 255.0F) + 0.5F);
      }
    }
  }
  for (size_t i = 0; i < count; ++i) rgba[4 * i + 3] = none_[i] > 0 ? 0 : 255;
  if (channels.size() == 1)
    for (size_t i = 0; i < count; ++i) rgba[4 * i + 1] = rgba[4 * i + 2] = rgba[4 * i];
  return {};
}

Status PictureReader::readAlpha(int col, int row, int cols, int rows, std::vector<uint8_t>& rgba) {
  if (picture_->alpha.band == 0 && !picture_->mask) return {};
  const GdalMessages messages;
  const size_t count = none_.size();
  const PictureBand& at = picture_->mask ? picture_->channels.front() : picture_->alpha;
  GDALRasterBand& band = picture_->mask ? *bandOf(at).GetMaskBand() : bandOf(at);
  const auto failed = [&](CPLErr status) { return status != CE_None || !messages.errors().empty(); };
  bytes_.resize(count);
  if (band.GetRasterDataType() == GDT_Byte) {
    if (failed(
            band.RasterIO(GF_Read, col, row, cols, rows, bytes_.data(), cols, rows, GDT_Byte, 0, 0, nullptr)))
      return readError(picture_->paths[static_cast<size_t>(at.file)], col, row, messages);
  } else {
    values_.resize(count);
    if (failed(band.RasterIO(GF_Read, col, row, cols, rows, values_.data(), cols, rows, GDT_Float32, 0, 0,
                             nullptr)))
      return readError(picture_->paths[static_cast<size_t>(at.file)], col, row, messages);
    // Integers are full at their largest value, floats at 1.
    const bool sixteen = band.GetRasterDataType() == GDT_UInt16;
    const float factor = sixteen ? 255.0F / 65535.0F : 255.0F;
    for (size_t i = 0; i < count; ++i)
      bytes_[i] = std::isnan(values_[i])
                      ? uint8_t{0}
                      : static_cast<uint8_t>(std::clamp(values_[i] * factor, 0.0F, 255.0F) + 0.5F);
  }
  for (size_t i = 0; i < count; ++i) rgba[4 * i + 3] = std::min(rgba[4 * i + 3], bytes_[i]);
  return {};
}

}  // namespace terrane
