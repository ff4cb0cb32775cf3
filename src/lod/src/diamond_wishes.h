#pragma once

#include <vector>

#include "judgement.h"
#include "known_tiles.h"
#include "patch_ground.h"
#include "selection_context.h"
#include "split.h"
#include "terrane/lod/cut.h"
#include "terrane/tiling/lattice.h"
#include "wish_list.h"

namespace terrane {

/// What single diamonds wait for: tiles that are not here, and meshes that are not made.
class DiamondWishes {
 public:
  explicit DiamondWishes(const SelectionContext& context) : context_(context) {}

  /// Wishes for what is missing of the root. Is enough of it here for anything to be drawn?
  bool wishForRoot(const KnownTile& root);
  /// Wishes for what is missing of the tiles that a diamond's children read, with SurfaceKind::Meshes of
  /// their meshes. Are they here? Implied: not, but a split would show nothing new.
  Residency wishForChildren(const Diamond& d, const Judgement& judged, const SplitChildren& children);
  /// Wishes for a tile that only a patch's shading waits for, whose texels look so large without it.
  void wishForShading(const KnownTile& tile, int layer, double texelPixels, const Judgement& judged);

  /// Hands over all that was wished for.
  void finish(Cut& cut);

 private:
  Residency wishForChildMeshes(const Judgement& judged, const SplitChildren& children);
  void wishForRootTile(int layer);
  void wishForTile(const KnownTile& tile, int layer, const Judgement& judged);
  int layerOf(const MeshPlace& place) const;
  double approximateArea(Prism prism) const;

  const SelectionContext& context_;
  WishList tiles_;
  std::vector<MeshWish> meshes_;
};

}  // namespace terrane
