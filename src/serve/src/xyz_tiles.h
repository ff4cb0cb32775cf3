#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "picture_tiles.h"
#include "terrane/base/result.h"
#include "terrane/engine/surface.h"
#include "xyz_places.h"

/// A dataset as tiles of web maps (docs/serving.md, "For other clients"): heights in the colours of a PNG,
/// and pictures.
namespace terrane::serve {

/// How heights are written into red, green and blue.
enum class HeightColors : uint8_t {
  Terrarium,   ///< 256 R + G + B / 256 - 32768 metres
  TerrainRgb,  ///< (65536 R + 256 G + B) / 10 - 10000 metres
};

/// How many steps of 1/256 m a height of a Terrarium tile is rounded to: as fine as the dataset and the
/// tile's pixels tell, a power of two. Else the noise in its last bits would be most of the file.
int terrariumStep(double metersAPixel, double maxErrorMeters);

/// The colour of a height; what the encoding cannot hold becomes its nearest. `step`: see terrariumStep().
struct HeightColor {
  uint8_t red = 0, green = 0, blue = 0;
};
HeightColor colorOfHeight(double meters, HeightColors colors, int step);

/// A tile of heights as the bytes of a PNG: of the surface on the level whose samples are a pixel wide or
/// finer. 0 m where there is no ground. Nothing where there is none in the whole tile. Error: tiles that
/// cannot be read.
Result<std::optional<std::vector<uint8_t>>> heightTile(const XyzAddress& address, HeightColors colors,
                                                       const XyzExtent& extent, SurfaceTiles& tiles,
                                                       Geographic& geographic);

enum class PictureFile : uint8_t { Webp, Png };

/// A tile of the imagery layer at `layer` of the manifest, the level chosen likewise; transparent where it
/// has no picture. Nothing where it has none in the whole tile.
Result<std::optional<std::vector<uint8_t>>> pictureTile(const XyzAddress& address, PictureFile file,
                                                        size_t layer, const XyzExtent& extent,
                                                        const Manifest& manifest, PictureTiles& tiles,
                                                        Geographic& geographic);

/// TileJSON 3.0 for tiles at `url`, which holds {z}, {x} and {y}. `encoding`: "terrarium", "mapbox", or empty
/// for pictures.
std::string tileJson(const Manifest& manifest, const XyzExtent& extent, int deepestZoom, std::string_view url,
                     std::string_view name, std::string_view encoding, std::string_view attribution);

}  // namespace terrane::serve
