#pragma once

#include <string>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/dataset/manifest.h"
#include "tile_codec.h"

namespace terrane {

/// What a build reads for one tile of the finest level.
struct SourceTile {
  TileId id;
  std::vector<float> heights;  ///< kTileSampleCount, metres; NaN: none
  int64_t ownSamples = 0;  ///< with a height, but for those that the next tile east or south holds as well
};

/// All finest tiles of an input that hold data, on the lattice that `terrane build INPUT` lays out, read the
/// way a build reads them (warped, scaled, without nodata). Error: the source's; a lattice other than the
/// manifest's.
Result<std::vector<SourceTile>> readSourceTiles(const std::string& input, const Manifest& manifest);

/// What the others code of it: the dataset's own integers where `boundMeters` is 0, else the heights rounded
/// to multiples of twice the bound.
TileContent contentOf(const SourceTile& tile, const ElevationScale& scale, double boundMeters);

/// Where there is ground, as integers 1 and 0; for each tile that has both.
std::vector<TileContent> voidMasks(const std::vector<SourceTile>& tiles);

}  // namespace terrane
