#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/base/result.h"

/// Imagery tiles to bytes and back (docs/format/imagery-v2.md): pure functions, any thread.
namespace terrane {

/// Texels along the side of an imagery tile; unlike samples they are not shared between tiles.
inline constexpr int kImageryTileSide = 256;
inline constexpr int kImageryTexels = kImageryTileSide * kImageryTileSide;

/// How the image in a payload is coded. The values are those in the payload.
enum class ImageryFormat : uint8_t { Jpeg = 1, Webp = 2 };

/// What a layer is coded with where nobody says otherwise.
inline constexpr ImageryFormat kDefaultImageryFormat = ImageryFormat::Webp;
/// The quality that a format is made with where nobody says otherwise: both look alike, WebP no worse.
constexpr int defaultImageryQuality(ImageryFormat format) {
  return format == ImageryFormat::Webp ? 75 : 80;
}

/// The texels of one tile: red, green, blue (sRGB, not multiplied by alpha) and alpha, row by row from the
/// north-west. What has alpha 0 has colours that are of no meaning.
struct ImageryTile {
  std::vector<uint8_t> rgba = std::vector<uint8_t>(static_cast<size_t>(kImageryTexels) * 4);
};

/// How much of a tile is there.
enum class ImageryCover : uint8_t { None, Partial, Full };
ImageryCover coverOf(const ImageryTile& tile);

/// Gives texels with alpha 0 the colours of what is around, so that neither a lossy code nor a filter that
/// reaches over the edge brings foreign colours in.
void fillTransparent(ImageryTile& tile);

/// A tile as bytes. `quality` is 1 to 100. JPEG is progressive, and its alpha goes beside it without loss;
/// the same tile gives the same bytes.
std::vector<uint8_t> encodeImagery(const ImageryTile& tile, ImageryFormat format, int quality);

/// The root of a layer of that format and quality as bytes: always JPEG, since a beginning of it is a picture
/// (decodeImageryPrefix), of a quality that looks as the layer's.
std::vector<uint8_t> encodeImageryRoot(const ImageryTile& tile, ImageryFormat format, int quality);

/// Bytes as a tile. Anything but a whole, sound payload is an error that says what is wrong.
Result<ImageryTile> decodeImagery(std::span<const uint8_t> payload);

/// What the image in a payload is, and where one may stop reading it.
struct ImageryLayout {
  ImageryFormat format = ImageryFormat::Jpeg;
  bool hasMask = false;
  size_t imageBegin = 0;         ///< where the plain JPEG or WebP file begins
  std::vector<size_t> scanEnds;  ///< from the payload's start, ascending; the payload's end stands for itself
};
/// Reads the head of a payload, of which only a beginning needs to be there.
Result<ImageryLayout> imageryLayout(std::span<const uint8_t> beginning);

/// The tile from the scans that are whole in a beginning of a JPEG payload, blurred as far as they are; from
/// a whole payload what decodeImagery() gives. Error: not even the first scan is there, or WebP cut short.
Result<ImageryTile> decodeImageryPrefix(std::span<const uint8_t> beginning);

}  // namespace terrane
