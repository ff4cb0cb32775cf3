#pragma once

#include <functional>
#include <glm/vec2.hpp>
#include <optional>
#include <vector>

#include "geographic.h"
#include "terrane/dataset/manifest.h"
#include "web_mercator.h"

namespace terrane::serve {

/// Where a dataset lies among the tiles of web maps.
struct XyzExtent {
  /// Degrees. Across the 180th meridian `west` is greater than `east`.
  double west = 0.0, south = 0.0, east = 0.0, north = 0.0;
  /// Finest samples that a pixel of tile 0/0/0 is wide, in the middle of the dataset.
  double samplesOfRoot = 1.0;

  /// Is a place in it, or no more than so many degrees beside it?
  bool contains(glm::dvec2 degrees, double beside = 0.0) const;
  /// May any place of a tile lie in it?
  bool meets(const XyzAddress& tile) const;
  /// The first z whose pixels are no wider than 2^-`finer` samples.
  int zoomFor(int finer) const;
};

/// Nothing where PROJ cannot relate the dataset's CRS to longitude and latitude, or Mercator's square does
/// not reach it. A millisecond: to be kept.
std::optional<XyzExtent> xyzExtentOf(const Manifest& manifest, Geographic& geographic);

/// Longitude and latitude, degrees, of a place of a lattice: its column and row, which may lie between.
using DegreesOf = std::function<glm::dvec2(double col, double row)>;

/// A lattice of `side` x `side` places, a power of two from 64 on or one more, in sample coordinates
/// (tiling/frame.h), row by row; not a number beyond the extent. PROJ is asked for one place in 16 x 16, and
/// for more where what lies between is off by more than a twentieth of a step. A millisecond or so; up to 0.1
/// s for what shows a continent.
std::vector<glm::dvec2> samplesOfLattice(int side, const DegreesOf& degreesOf, const XyzExtent& extent,
                                         const Frame& frame, Geographic& geographic);

/// The middles of a tile's pixels in the dataset, in sample coordinates (tiling/frame.h), row by row from the
/// north-west; not a number beyond the extent.
struct XyzPlaces {
  std::vector<glm::dvec2> samples;
  double samplesAPixel = 1.0;  ///< finest samples that the tile's smallest pixel is wide, about
};

/// See samplesOfLattice().
XyzPlaces xyzPlacesOf(const XyzAddress& tile, const XyzExtent& extent, const Frame& frame,
                      Geographic& geographic);

}  // namespace terrane::serve
