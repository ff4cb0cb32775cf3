#pragma once

#include "terrane/codec/tile.h"
#include "terrane/render/prepare_tile.h"
#include "tile_shading.h"

namespace terrane {

/// See prepare_tile.h.
struct PreparedTile {
  Coverage shown;
  TileShading shading;
};

}  // namespace terrane
