#pragma once

#include <unordered_map>
#include <unordered_set>

#include "terrane/tiling/lattice.h"

namespace terrane {

/// What one selection tells the next one, so that detail whose tiles arrive fades in instead of popping up. A
/// plain value that the caller keeps, one for each view; empty for a view that was not drawn yet. Begin with
/// an empty one when the dataset changes or the camera jumps. selectPatches() is all that looks inside.
struct MorphHistory {
  int latticeDepth = -1;  ///< that the diamonds below are counted in
  int k = 0;
  /// Diamonds that would have split, had their tiles been here.
  std::unordered_set<Diamond, DiamondHash> heldBack;
  /// Diamonds that are fading in, and how far each is, 0 to 1.
  std::unordered_map<Diamond, double, DiamondHash> ramps;
};

}  // namespace terrane
