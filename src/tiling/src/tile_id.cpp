#include "terrane/tiling/tile_id.h"

#include <fmt/format.h>

namespace terrane {

std::string toString(TileId id) {
  return fmt::format("{}/{}/{}", id.level, id.col, id.row);
}

}  // namespace terrane
