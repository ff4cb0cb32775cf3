#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "imagery_store.h"
#include "terrane/base/result.h"
#include "terrane/lod/cut.h"
#include "terrane/tiling/frame.h"
#include "terrane/tiling/lattice.h"
#include "tile_store.h"

namespace terrane {

/// What the vertex shader knows of one patch; the layout of patch.vert's per-instance attributes.
struct PatchInstance {
  std::array<int32_t, 4> lattice{};  ///< origin from the anchor (x, y), unit, quarter turns
  std::array<int32_t, 4> texel{};    ///< origin in the height tile (x, y), unit there, layer
  std::array<float, 4>
      shading{};  ///< origin in the shading tile (x, y), unit there, its cells in a finest data cell
  std::array<int32_t, 4>
      layers{};  ///< shading layer, coverage layer, colour 0xBBGGRR, error in pixels as float bits
  std::array<int32_t, 4> imagery{-1, 0, 0, 0};  ///< page, morph as float bits
};
static_assert(sizeof(PatchInstance) == 80);

/// The instances of a cut, by template: 0 the right-angle one (even bintree levels), 1 the hypotenuse one.
struct PatchInstances {
  std::array<std::vector<PatchInstance>, 2> byTemplate;
  int64_t patchCount() const {
    return static_cast<int64_t>(byTemplate[0].size()) + static_cast<int64_t>(byTemplate[1].size());
  }
  int tileCount = 0;  ///< different tiles that heights are read from
};

/// The lattice point nearest to a local point; points far outside the world are moved to where its
/// coordinates and all differences stay within 32 bits.
LatticePoint anchorNear(const Lattice& lattice, const Frame& frame, glm::dvec3 pointLocal);

/// Metres between neighbouring lattice points, (x, y).
glm::dvec2 latticeSpacing(const Frame& frame, int latticeDepth);

/// A colour of its own for a tile, the same in every run, as 0xBBGGRR.
int32_t tileColor(TileId id);
/// The same for tiles of which mostly the same is asked for several times.
class TileColors {
 public:
  int32_t of(TileId id) {
    if (!(id == last_)) color_ = tileColor(id);
    last_ = id;
    return color_;
  }

 private:
  TileId last_{-1, 0, 0};
  int32_t color_ = 0;
};

/// From where fragments of a patch are lit.
struct ShadingPlace {
  TileId tile;                              ///< the patch's shading tile or, if it is not there, an ancestor
  const TileStore::Entry* entry = nullptr;  ///< never null
};
/// Fails where neither the patch's shading tile nor an ancestor down to its own tile is resident.
Result<ShadingPlace> shadingPlace(const Patch& patch, const TileStore& tiles);
/// A point of the lattice in cells of the shading tile, what `unit` of the lattice is there, and its cells in
/// a finest data cell. note: it may be finer than the lattice; then cells are counted in halves, quarters and
/// so on.
std::array<float, 4> shadingCells(LatticePoint origin, int32_t unit, int latticeDepth, TileId shadingTile,
                                  const Frame& frame);

/// Fills in the instances of a cut (and the pages of their imagery, unless that is null), nearest to `anchor`
/// first. A shading tile that is not resident is replaced by its nearest ancestor that is. Patches without
/// any ground are left out. Fails if a tile that a patch's heights come from is not resident.
Result<PatchInstances> makePatchInstances(const Cut& cut, const Frame& frame, LatticePoint anchor,
                                          const TileStore& tiles, ImageryStore* imagery = nullptr);

}  // namespace terrane
