#include "xyz_tiles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>
#include <unordered_map>

#include "filled_ground.h"
#include "terrane/render/png.h"

namespace terrane::serve {
namespace {

/// Steps of a Terrarium height in a metre.
constexpr double kTerrariumSteps = 256.0;
/// A height is told as finely as makes a slope of a thousandth, from pixel to pixel.
constexpr double kSlope = 1e-3;
/// Of pictures that are made anew: a little better than what they were made of.
constexpr int kPictureQuality = 85;

/// The texels of an imagery layer's level, across its tiles.
class Texels {
 public:
  Texels(PictureTiles& tiles, size_t layer, int level) : tiles_(tiles), layer_(layer), level_(level) {}

  /// Red, green and blue times alpha, and alpha, 0 to 255, between the middles of four texels.
  Result<std::array<double, 4>> between(glm::dvec2 texel) {
    const glm::dvec2 corner = glm::floor(texel - 0.5);
    const glm::dvec2 part = texel - 0.5 - corner;
    std::array<double, 4> out{};
    for (int i = 0; i < 4; ++i) {
      const int right = i & 1, below = i >> 1;
      const double weight = (right != 0 ? part.x : 1.0 - part.x) * (below != 0 ? part.y : 1.0 - part.y);
      TERRANE_ASSIGN(const uint8_t* rgba,
                     at(static_cast<int64_t>(corner.x) + right, static_cast<int64_t>(corner.y) + below));
      if (rgba == nullptr) continue;
      const double alpha = weight * rgba[3];
      for (size_t c = 0; c < 3; ++c) out[c] += alpha * rgba[c] / 255.0;
      out[3] += alpha;
    }
    return out;
  }

 private:
  /// Null: there is no picture.
  Result<const uint8_t*> at(int64_t col, int64_t row) {
    const int64_t side = int64_t{kImageryTileSide} << level_;
    if (col < 0 || row < 0 || col >= side || row >= side) return nullptr;
    const TileId id{level_, static_cast<int32_t>(col / kImageryTileSide),
                    static_cast<int32_t>(row / kImageryTileSide)};
    if (id != last_) {
      auto known = here_.find(id);
      if (known == here_.end()) {
        TERRANE_ASSIGN(auto tile, tiles_.get(layer_, id));
        known = here_.emplace(id, std::move(tile)).first;
      }
      last_ = id;
      tile_ = known->second.get();
    }
    if (tile_ == nullptr) return nullptr;
    return tile_->rgba.data() + 4 * (row % kImageryTileSide * kImageryTileSide + col % kImageryTileSide);
  }

  PictureTiles& tiles_;
  size_t layer_;
  int level_;
  std::unordered_map<TileId, std::shared_ptr<const ImageryTile>, TileIdHash> here_;
  TileId last_{-1, 0, 0};
  const ImageryTile* tile_ = nullptr;
};

}  // namespace

int levelFor(double finestSamples, int finestLevel) {
  const int coarser = static_cast<int>(std::floor(std::log2(std::max(finestSamples, 1.0)) + 1e-6));
  return std::max(finestLevel - coarser, 0);
}

int terrariumStep(double metersAPixel, double maxErrorMeters) {
  const double wanted = std::max(kSlope * metersAPixel, 0.25 * maxErrorMeters) * kTerrariumSteps;
  const int power = static_cast<int>(std::floor(std::log2(std::clamp(wanted, 1.0, kTerrariumSteps))));
  return 1 << power;
}

HeightColor colorOfHeight(double meters, HeightColors colors, int step) {
  const bool isTerrarium = colors == HeightColors::Terrarium;
  const double offset = isTerrarium ? 32768.0 : 10000.0;
  const double unit = isTerrarium ? kTerrariumSteps / step : 10.0;
  const auto most = isTerrarium ? (1 << 24) / step - 1 : (1 << 24) - 1;
  const int number =
      static_cast<int>(std::clamp(std::round((meters + offset) * unit), 0.0, static_cast<double>(most))) *
      (isTerrarium ? step : 1);
  return {static_cast<uint8_t>(number >> 16), static_cast<uint8_t>(number >> 8 & 255),
          static_cast<uint8_t>(number & 255)};
}

Result<std::optional<std::vector<uint8_t>>> heightTile(const XyzAddress& address, HeightColors colors,
                                                       const XyzExtent& extent, SurfaceTiles& tiles,
                                                       Geographic& geographic) {
  const Manifest& manifest = tiles.manifest();
  const XyzPlaces places = xyzPlacesOf(address, extent, manifest.frame, geographic);
  FilledGround ground(tiles, levelFor(places.samplesAPixel, manifest.frame.finestLevel));
  const int step =
      terrariumStep(places.samplesAPixel * manifest.frame.spacingXMeters(), manifest.maxErrorMeters);
  std::vector<uint8_t> rgba(4 * places.samples.size());
  for (size_t i = 0; i < places.samples.size(); ++i) {
    TERRANE_ASSIGN(const double height, ground.heightAt(places.samples[i]));
    const HeightColor color = colorOfHeight(height, colors, step);
    const std::array<uint8_t, 4> pixel = {color.red, color.green, color.blue, 255};
    std::copy(pixel.begin(), pixel.end(), rgba.begin() + static_cast<ptrdiff_t>(4 * i));
  }
  if (!ground.hasGround()) return std::optional<std::vector<uint8_t>>{};
  return std::optional(encodePng(kXyzSide, kXyzSide, rgba));
}

Result<std::optional<std::vector<uint8_t>>> pictureTile(const XyzAddress& address, PictureFile file,
                                                        size_t layer, const XyzExtent& extent,
                                                        const Manifest& manifest, PictureTiles& tiles,
                                                        Geographic& geographic) {
  static_assert(kXyzSide == kImageryTileSide);
  const XyzPlaces places = xyzPlacesOf(address, extent, manifest.frame, geographic);
  // A texel covers a cell of the elevation's level of the same number, if there were one.
  const int deeper = manifest.imagery[layer].finestLevel - manifest.frame.finestLevel;
  const double finest = std::ldexp(1.0, deeper);
  const int level = levelFor(places.samplesAPixel * finest, manifest.imagery[layer].finestLevel);
  const double texelsASample = std::ldexp(1.0, level - manifest.frame.finestLevel);
  Texels texels(tiles, layer, level);
  ImageryTile out;
  for (size_t i = 0; i < places.samples.size(); ++i) {
    std::array<double, 4> color{};
    if (!std::isnan(places.samples[i].x)) {
      TERRANE_ASSIGN(color, texels.between(places.samples[i] * texelsASample));
    }
    const double alpha = color[3];
    for (size_t c = 0; c < 3; ++c)
      out.rgba[4 * i + c] =
          static_cast<uint8_t>(alpha > 0.0 ? std::min(std::round(255.0 * color[c] / alpha), 255.0) : 0.0);
    out.rgba[4 * i + 3] = static_cast<uint8_t>(std::min(std::round(alpha), 255.0));
  }
  if (coverOf(out) == ImageryCover::None) return std::optional<std::vector<uint8_t>>{};
  if (file == PictureFile::Png) return std::optional(encodePng(kXyzSide, kXyzSide, out.rgba));
  // A payload ends with a plain WebP file.
  if (coverOf(out) == ImageryCover::Partial) fillTransparent(out);
  const std::vector<uint8_t> payload = encodeImagery(out, ImageryFormat::Webp, kPictureQuality);
  TERRANE_ASSIGN(const ImageryLayout layout, imageryLayout(payload));
  return std::optional(
      std::vector<uint8_t>(payload.begin() + static_cast<ptrdiff_t>(layout.imageBegin), payload.end()));
}

std::string tileJson(const Manifest& manifest, const XyzExtent& extent, int deepestZoom, std::string_view url,
                     std::string_view name, std::string_view encoding, std::string_view attribution) {
  // What crosses the 180th meridian is, in this form, all around the earth.
  const bool isCrossing = extent.west > extent.east;
  nlohmann::ordered_json out = {
      {"tilejson", "3.0.0"},
      {"name", name},
      {"tiles", nlohmann::ordered_json::array({url})},
      {"tileSize", kXyzSide},
      {"minzoom", 0},
      {"maxzoom", deepestZoom},
      {"bounds",
       {isCrossing ? -180.0 : extent.west, extent.south, isCrossing ? 180.0 : extent.east, extent.north}}};
  if (!isCrossing)
    out["center"] = {0.5 * (extent.west + extent.east), 0.5 * (extent.south + extent.north),
                     std::max(deepestZoom - 4, 0)};
  if (!encoding.empty()) {
    out["encoding"] = encoding;
    out["minHeightMeters"] = manifest.minHeight;
    out["maxHeightMeters"] = manifest.maxHeight;
    out["maxErrorMeters"] = manifest.maxErrorMeters;
    if (!manifest.verticalDatum.empty()) out["verticalDatum"] = manifest.verticalDatum;
  }
  if (!attribution.empty()) out["attribution"] = attribution;
  return out.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace terrane::serve
