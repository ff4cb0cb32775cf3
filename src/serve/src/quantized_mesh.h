#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "terrane/base/result.h"
#include "terrane/engine/surface.h"
#include "xyz_places.h"

/// A dataset as CesiumJS's terrain: quantized-mesh 1.0 (github.com/CesiumGS/quantized-mesh) in the geographic
/// scheme, two tiles at level 0, rows from the south.
namespace terrane::serve {

/// The deepest level: 64 cells along a tile's side are there as fine as the dataset.
int deepestTerrainLevel(const XyzExtent& extent);

/// From "12", "4290", "3047" (the file's ending is off already). Nothing for what is no address.
std::optional<XyzAddress> readTerrainAddress(std::string_view z, std::string_view x, std::string_view y);

/// A tile. It is off by no more than CesiumJS takes a tile of its level for, so that its screen-space error
/// is one, but for what lies between samples; at the deepest level by no more than the dataset itself. With
/// normals. A tile without ground is level, at 0 m. Error: the dataset's tiles cannot be read. Some ten
/// milliseconds.
Result<std::string> terrainTile(const XyzAddress& address, const XyzExtent& extent, SurfaceTiles& tiles,
                                Geographic& geographic);

/// "layer.json": what CesiumTerrainProvider reads first. `url` holds {z}, {x} and {y}.
std::string terrainLayerJson(const Manifest& manifest, const XyzExtent& extent, std::string_view url);

}  // namespace terrane::serve
