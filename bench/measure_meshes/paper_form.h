#pragma once

#include "height_grid.h"
#include "terrane/codec/strip_mesh.h"

/// A whole DEM in the form of Dick, Schneider and Westermann (2009), with that paper's parameters: a pyramid
/// of means in tiles of 513 samples a side, neighbours sharing their border; the bound of a level is its
/// spacing, of which quantisation takes a quarter, against that level's own heights. For a smaller bound at
/// the finest level, that level is meshed again at a half of its spacing in tiles of 257, and at a quarter in
/// tiles of 129.
namespace terrane {

struct PaperLevel {
  double spacings = 1.0;  ///< the bound, in sample spacings of the finest level
  int64_t tiles = 0;      ///< with a height
  int64_t triangles = 0;
  uint64_t bits = 0;     ///< strip headers and strip data, as the paper counts
  double seconds = 0.0;  ///< CPU time of meshing and coding
};

struct PaperForm {
  std::vector<PaperLevel> levels;  ///< finest first
  std::vector<StripMesh> finest;   ///< the first level's tiles
};

/// The levels that a DEM needs for a bound of 1 / `shares` of its spacing at the finest level (1, 2 or 4).
/// Cost: all cores, for a while. Error: encodeStripMesh()'s.
Result<PaperForm> encodePaperForm(HeightGrid grid, double spacingMeters, int shares);

/// What one thread needs to decode all of these to vertices: CPU seconds, the median of five turns.
Result<double> measurePaperDecoding(const std::vector<StripMesh>& meshes);

}  // namespace terrane
