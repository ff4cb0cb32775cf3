#pragma once

#include "known_tiles.h"
#include "morph_ramps.h"
#include "patch_ground.h"
#include "pieces.h"
#include "selection_context.h"
#include "terrane/tiling/lattice.h"

namespace terrane {

/// A triangle that a split would make.
struct SplitChild {
  Triangle triangle;
  PatchGround ground;
};
using SplitChildren = UpToFour<SplitChild>;

/// What splitting a diamond would make; both of its triangles are there.
SplitChildren childrenOf(const SelectionContext& context, KnownTiles& tiles, const Pieces& pieces);

/// A split that was made.
struct Split {
  float morph = 1.0F;  ///< of the triangles that it made
  MorphRamps::Progress ramp;
  double errorMeters = 0.0;  ///< of the diamond before it
  double errorPixels = 0.0;
  double startMeters = 0.0;  ///< error of the triangles at morph 0, at least the diamond's

  /// A bound for a patch that is still part its parent: both errors as they look over the parent's prism, in
  /// which both surfaces lie.
  double mixedErrorPixels(double ownErrorMeters) const {
    if (errorMeters <= 0.0) return 0.0;
    const auto share = static_cast<double>(morph);
    const double mixed = (1.0 - share) * startMeters + share * ownErrorMeters;
    return errorPixels * mixed / errorMeters;
  }
};

}  // namespace terrane
