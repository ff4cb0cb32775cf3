#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/tile.h"

namespace terrane {

/// What is stored of a tile: a payload for each of the dataset's layers of significance, the first first.
using TilePayloads = std::vector<std::vector<uint8_t>>;

/// Decodes a tile with all of its layers. `parent` has all of them, too, and is null for the root only; there
/// are scale.layerCount payloads. Errors: those of decodeTile() and refineTile(), with the layer where it is
/// not the first. `recycled`: see decodeTile().
Result<Tile> decodeAllLayers(std::span<const std::vector<uint8_t>> payloads, const TileSamples* parent,
                             int quadrant, const ElevationScale& scale, Tile recycled = {});

}  // namespace terrane
