#pragma once

#include <array>
#include <cstdint>

#include "terrane/codec/mesh_level.h"
#include "terrane/codec/tile.h"
#include "terrane/lod/cut.h"
#include "terrane/lod/morph_history.h"
#include "terrane/tiling/camera.h"
#include "terrane/tiling/frame.h"

namespace terrane {

/// The tiles that are here now. Whoever holds tiles answers; parents of a resident tile are resident.
class ResidentTiles {
 public:
  virtual ~ResidentTiles() = default;
  /// The tile, or null where it is not resident. Valid until residency changes.
  virtual const Tile* find(TileId id) const = 0;
  /// A resident tile's meshes of a mesh level, or null where they are not made. Only for SurfaceKind::Meshes.
  virtual const MeshLevel* findMeshes(TileId, int) const { return nullptr; }
};

/// What a split is decided by. All but Full are there to show what each part does (paper 000, figure 3).
enum class SplitMetric : uint8_t {
  Full,          ///< geometric error in pixels, in view
  DistanceOnly,  ///< sample spacing in pixels, as if all ground were equally rough; levels below the data too
  ErrorOnly,     ///< error in metres alone, as if all ground were equally far
};

struct PatchSelection {
  SurfaceKind surface = SurfaceKind::Patches;
  PatchGrid grid;                ///< K; of SurfaceKind::Patches
  double tolerancePixels = 1.0;  ///< tau, > 0
  double texelPixels = 1.0;      ///< size of a texel of lighting on screen that is aimed at, > 0
  bool cull = true;              ///< leave out what is outside the frustum
  bool hide = true;              ///< with `cull`, leave out meshes that nearer ground hides
  bool morph = true;             ///< let patches glide into being; only for SplitMetric::Full
  SplitMetric metric = SplitMetric::Full;
  double exaggeration = 1.0;  ///< of heights, > 0
  double nearMeters = 0.1;
  int levelsBelowData = 0;  ///< tile levels that DistanceOnly may refine below the data
};

/// Chooses the finest conforming cut that the resident tiles allow (docs/architecture.md, "Patches and
/// tiles").
///
/// A diamond splits iff the metric asks for it, the tiles of all triangles that it would make are resident,
/// and its parents have split; so the result meets without T-junctions whatever is resident, and depends on
/// nothing but the arguments. Tiles that the metric asks for and that are not resident become wishes. With
/// everything resident, every patch in view has an error of at most tau, or the dataset's own bound. The
/// root tile must be resident, else the cut is empty and wishes for it.
///
/// With SurfaceKind::Meshes patches are those of MeshScale::of(frame), and go on where tiles end: smaller
/// ones of the finest tiles' samples, with tighter bounds, until all samples count. A diamond splits only
/// where the meshes of all its children are made, too; those that the metric asks for and that are not become
/// mesh wishes. Only with SplitMetric::Full. With `selection.cull` those that nearer ones surely hide are in
/// Cut::hidden.
///
/// With `selection.morph` the drawn surface is a continuous function of the camera. A `history` makes it one
/// of time too: what a diamond's tiles or its parents held back in the last selection with that history,
/// `elapsedSeconds` ago, fades in over 0.3 s or less, and a child may only split after its parents are there
/// in full; `Cut::ramping` says how many are on the way. Without one everything resident shows at once.
///
/// Cost: about a microsecond a diamond in view, no I/O, no clock.
Cut selectPatches(const PatchSelection& selection, const Frame& frame, const ElevationScale& scale,
                  const Camera& camera, const ResidentTiles& tiles, MorphHistory* history = nullptr,
                  double elapsedSeconds = 0.0);

/// The error code of a diamond for patches of `grid`, from what a tile carries: its own code for K >= 17; for
/// smaller K that of the diamond for K = 17 that holds it, which is never too small and stays strictly
/// saturated. `d` is in tile-local cells, with its level less 2 * tileLevel, one of the tile's own diamonds
/// for that K.
uint8_t nodeErrorCode(const PatchGrid& grid, const TileNodes& nodes, bool isRoot, const Diamond& d);

}  // namespace terrane
