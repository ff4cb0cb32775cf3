#pragma once

#include <functional>
#include <glm/vec2.hpp>
#include <vector>

#include "terrane/stream/tile_stream.h"
#include "terrane/tiling/frame.h"

namespace terrane {

/// Lines along which the ground should be here as finely as it is stored, whatever the picture needs.
class StudiedGround {
 public:
  /// Places in local metres; a line of one place is that place.
  void setLines(std::vector<std::vector<glm::dvec2>> lines) {
    lines_ = std::move(lines);
    areTilesStale_ = true;
  }
  bool isEmpty() const { return lines_.empty(); }
  /// Wishes for the tiles along the lines, behind all that the picture wants: as fine as `mostTiles` allow.
  /// What is stored is looked up anew every half second, for directories arrive in parts.
  void addWishes(const TileStream& stream, size_t mostTiles, double nowSeconds,
                 std::vector<StreamWish>& wishes);

 private:
  std::vector<std::vector<glm::dvec2>> lines_;
  std::vector<std::vector<glm::dvec2>> samples_;  ///< thinned, of lines that are not stale
  std::vector<TileId> tiles_;
  bool areTilesStale_ = false;
  double nextLookSeconds_ = 0.0;
};

/// The places of a line that tell which tiles of a side it comes into: where it enters and leaves each of
/// them. A track has many places in one tile.
std::vector<glm::dvec2> thinned(const std::vector<glm::dvec2>& line, double tileSide);

/// The finest tiles along lines: those of a level that are stored, and where none is, the ones above, down to
/// the last level of which there are no more than `most`. `lines`: in samples of the finest level. At least
/// the root. Cost: microseconds a tile, and some nanoseconds for each segment and level.
std::vector<TileId> tilesAlong(const std::vector<std::vector<glm::dvec2>>& lines, const Frame& frame,
                               const std::function<bool(TileId)>& isStored, size_t most);

}  // namespace terrane
