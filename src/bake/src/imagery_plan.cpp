#include "imagery_plan.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "input_crs.h"
#include "input_list.h"
#include "terrane/dataset/hash.h"
#include "warp.h"

namespace terrane {

namespace {

/// A level whose texels are up to this factor larger than pixels is fine enough.
const double kCoarserByLevels = 0.25;
constexpr double kLowShare = 0.02;
constexpr double kHighShare = 0.98;

/// The files of one picture: "A+B+C", unless a file has that very name.
std::vector<std::string> splitPicture(const std::string& text) {
  std::error_code code;
  if (std::filesystem::exists(text, code)) return {text};
  std::vector<std::string> parts;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find('+', begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

/// All pictures that a layer's inputs stand for.
Result<std::vector<std::vector<std::string>>> expandPictures(const std::vector<std::string>& inputs) {
  std::vector<std::vector<std::string>> out;
  for (const std::string& input : inputs) {
    const std::vector<std::string> parts = splitPicture(input);
    if (parts.size() == 1) {
      TERRANE_ASSIGN(const std::vector<InputPath> paths, expandInputs({input}));
      for (const InputPath& path : paths) out.push_back({path.path});
      continue;
    }
    std::vector<std::string> files;
    for (const std::string& part : parts) {
      TERRANE_ASSIGN(const std::vector<InputPath> path, expandInputs({part}));
      if (path.size() != 1)
        return makeError("{}: stands for {} files; a picture made of several needs one at each place", part,
                         path.size());
      files.push_back(path.front().path);
    }
    out.push_back(std::move(files));
  }
  return out;
}

Result<PlacedPicture> placePicture(PictureInput input, const ImageryFrame& frame) {
  PlacedPicture out;
  out.input = std::move(input);
  const InputRaster& raster = out.input.raster;
  TERRANE_ASSIGN(OGRSpatialReference crs, crsFromUser(frame.crsWkt, "--crs"));
  const auto& g = raster.geoTransform;
  // A rotation that moves no pixel by a hundredth is rounding.
  constexpr double kTurned = 0.01;
  out.aligned = raster.hasGeoTransform && std::abs(g[2]) * raster.height < kTurned * std::abs(g[1]) &&
                std::abs(g[4]) * raster.width < kTurned * std::abs(g[5]) && sameCrs(raster.crs, crs);
  if (out.aligned) {
    std::tie(out.west, out.east) = std::minmax({g[0], g[0] + g[1] * raster.width});
    std::tie(out.south, out.north) = std::minmax({g[3], g[3] + g[5] * raster.height});
    out.spacing = std::sqrt(std::abs(g[1] * g[5]));
    return out;
  }
  TERRANE_ASSIGN(const GdalDataset dataset, openRaster(raster.path));
  TERRANE_ASSIGN(const WarpPlan plan, planWarp(raster, *dataset, frame.crsWkt));
  out.west = plan.west;
  out.east = plan.east;
  out.south = plan.south;
  out.north = plan.north;
  out.spacing = plan.spacing;
  return out;
}

/// The level whose texels are about as large as pixels.
int levelFor(double spacing, const Frame& frame) {
  const double finest = std::sqrt(frame.spacingX * frame.spacingY);
  const double level = frame.finestLevel + std::log2(finest / spacing) - kCoarserByLevels;
  return std::clamp(static_cast<int>(std::ceil(level)), 0, kMaxLevel);
}

/// The columns and rows of a level's tiles that a picture touches, where there can be ground; end exclusive.
struct TileRange {
  int64_t firstCol, firstRow, endCol, endRow;
};
TileRange rangeOf(const PlacedPicture& picture, const ImageryFrame& where, int level) {
  const Frame& frame = where.frame;
  const double perTile = std::ldexp(kImageryTileSide, frame.finestLevel - level);  // finest cells
  const auto first = [](double tiles) {
    return static_cast<int64_t>(std::floor(std::clamp(tiles + 1e-7, 0.0, 1e9)));
  };
  const auto end = [](double tiles, double most) {
    return static_cast<int64_t>(std::ceil(std::clamp(std::min(tiles, most) - 1e-7, 0.0, 1e9)));
  };
  const double west = (picture.west - frame.originEasting) / frame.spacingX / perTile;
  const double east = (picture.east - frame.originEasting) / frame.spacingX / perTile;
  const double north = (frame.originNorthing - picture.north) / frame.spacingY / perTile;
  const double south = (frame.originNorthing - picture.south) / frame.spacingY / perTile;
  return {first(west), first(north), end(east, static_cast<double>(where.extentCols - 1) / perTile),
          end(south, static_cast<double>(where.extentRows - 1) / perTile)};
}

/// The values that become black and white, the same for all pictures of a layer.
Status findStretch(const ImageryLayerOptions& options, PlannedLayer& layer) {
  size_t channels = 0;
  const auto needsOne = [&](const PictureInput& input) {
    return input.palette.empty() && (options.stretch || !input.bytes);
  };
  std::vector<std::vector<float>> values;
  for (const PlacedPicture& picture : layer.pictures) {
    if (!needsOne(picture.input)) continue;
    channels = std::max(channels, picture.input.channels.size());
    if (!options.stretch) TERRANE_TRY(sampleValues(picture.input, values));
  }
  std::vector<std::array<double, 2>>& stretch = layer.record.stretch;
  for (size_t c = 0; c < channels; ++c) {
    if (options.stretch) {
      stretch.push_back(*options.stretch);
      continue;
    }
    std::vector<float>& of = values[c];
    if (of.empty()) of = {0.0F, 1.0F};
    const auto at = [&](double share) {
      const auto place = of.begin() + static_cast<ptrdiff_t>(share * static_cast<double>(of.size() - 1));
      std::nth_element(of.begin(), place, of.end());
      return static_cast<double>(*place);
    };
    const double low = at(kLowShare);
    stretch.push_back({low, std::max(at(kHighShare), low + 1e-6)});
    if (stretch.back()[1] - low < 1e-6 * std::max(1.0, std::abs(low))) stretch.back()[1] = low + 1.0;
  }
  for (PlacedPicture& picture : layer.pictures) {
    if (!needsOne(picture.input)) continue;
    picture.input.stretch.assign(stretch.begin(),
                                 stretch.begin() + static_cast<ptrdiff_t>(picture.input.channels.size()));
  }
  return {};
}

Result<PlannedLayer> planLayer(const ImageryLayerOptions& options, const ImageryFrame& frame,
                               Progress& progress) {
  PlannedLayer layer;
  ImageryLayerRecord& record = layer.record;
  record.name = options.name;
  record.archive = imageryArchiveName(options.name);
  record.attribution = options.attribution;
  if (options.inputs.empty()) return makeError("imagery layer '{}': names no file", options.name);
  TERRANE_ASSIGN(const auto pictures, expandPictures(options.inputs));

  double spacing = 0.0;
  for (const std::vector<std::string>& paths : pictures) {
    TERRANE_ASSIGN(PictureInput input, describePicture(paths, options));
    TERRANE_ASSIGN(PlacedPicture picture, placePicture(std::move(input), frame));
    const TileRange range = rangeOf(picture, frame, levelFor(picture.spacing, frame.frame));
    if (range.firstCol >= range.endCol || range.firstRow >= range.endRow) {
      if (pictures.size() > 1)
        progress.warn(fmt::format("{}: does not lie over the elevation; left out", paths.front()));
      continue;
    }
    spacing = layer.pictures.empty() ? picture.spacing : std::min(spacing, picture.spacing);
    layer.pictures.push_back(std::move(picture));
  }
  if (layer.pictures.empty()) {
    return makeError(
        "{}: imagery layer '{}' does not lie over the elevation; check its CRS (--imagery-crs) or leave it "
        "out",
        pictures.front().front(), options.name);
  }
  record.finestLevel = levelFor(spacing, frame.frame);
  TERRANE_TRY(findStretch(options, layer));

  // The tiles of the finest level, and what the manifest says of the inputs.
  std::set<std::pair<int64_t, int64_t>> tiles;
  for (PlacedPicture& picture : layer.pictures) {
    const TileRange range = rangeOf(picture, frame, record.finestLevel);
    for (int64_t row = range.firstRow; row < range.endRow; ++row)
      for (int64_t col = range.firstCol; col < range.endCol; ++col) tiles.emplace(row, col);
    for (size_t i = 0; i < picture.input.records.size(); ++i) {
      InputRecord& input = picture.input.records[i];
      input.warped = !picture.aligned;
      input.resampling = "cubic";
      input.nativeLevel = levelFor(picture.spacing, frame.frame);
      const std::string file = fileBehind(picture.input.paths[i]);
      if (!file.empty() && input.bytes > 0) {
        TERRANE_ASSIGN(input.sha256, sha256OfFile(file));
      }
      record.inputs.push_back(input);
    }
    if (record.bands.empty()) record.bands = picture.input.bandsText();
  }
  const int level = record.finestLevel;
  for (const auto& [row, col] : tiles)
    layer.finestTiles.push_back({level, static_cast<int32_t>(col), static_cast<int32_t>(row)});
  return layer;
}

}  // namespace

Result<std::shared_ptr<const ImageryPlan>> planImagery(const ImageryOptions& options,
                                                       const ImageryFrame& frame, Progress& progress) {
  auto plan = std::make_shared<ImageryPlan>();
  plan->frame = frame;
  plan->format = options.format;
  plan->quality = options.quality;
  if (!options.layers.empty())
    progress.beginStage("opening imagery", static_cast<int64_t>(options.layers.size()), "layers");
  for (const ImageryLayerOptions& layer : options.layers) {
    for (const PlannedLayer& before : plan->layers) {
      if (before.record.name == layer.name)
        return makeError("imagery layer '{}': named twice; give each layer a name of its own", layer.name);
    }
    TERRANE_ASSIGN(PlannedLayer planned, planLayer(layer, frame, progress));
    planned.record.format = options.format;
    planned.record.quality = options.quality;
    plan->layers.push_back(std::move(planned));
    progress.advance(1);
  }
  return std::shared_ptr<const ImageryPlan>(std::move(plan));
}

}  // namespace terrane
