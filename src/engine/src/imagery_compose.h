#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "terrane/codec/imagery_codec.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

/// The part of an ancestor, `levelsUp` levels above, that lies on `id`, enlarged.
ImageryTile enlargeImagery(const ImageryTile& ancestor, int levelsUp, TileId id);

/// Lays `over` on `under`.
void layImageryOver(ImageryTile& under, const ImageryTile& over);

/// A tile with one texel of border around it, 258 x 258 texels of four bytes; `find` gives it and its
/// neighbours, null where there is none: there the border repeats the tile's own edge. Empty where the tile
/// itself is not there.
std::vector<uint8_t> borderedImagery(TileId id, const std::function<const ImageryTile*(TileId)>& find);

/// One part of that border, the one towards the neighbour (dx, dy), both -1 to 1: its place in the bordered
/// tile and its texels; (0, 0) is the tile's own inside.
struct ImageryBorder {
  int x = 0, y = 0, width = 0, height = 0;
  std::vector<uint8_t> rgba;
};
ImageryBorder imageryBorder(TileId id, int dx, int dy, const std::function<const ImageryTile*(TileId)>& find);

}  // namespace terrane
