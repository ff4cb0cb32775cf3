#pragma once

#include <algorithm>

#include "known_tiles.h"
#include "pieces.h"
#include "selection_context.h"
#include "terrane/lod/screen_metric.h"

namespace terrane {

/// How a diamond looks from the camera, and whether it asks to be split.
struct Judgement {
  ScreenMetric::Sight sight = ScreenMetric::Sight::None;
  double errorMeters = 0.0;  ///< of its patches as they are
  double errorPixels = 0.0;
  bool wantsSplit = false;
  bool beyondCodes = false;  ///< its error is more than codes can tell: always worth a split
  /// How many times too large its error and its lighting's texels look; splits where one is above 1.
  double byError = 0.0;
  double byTexel = 0.0;
  double excess() const { return std::max(byError, byTexel); }
  double urgency = 0.0;  ///< for the wish list
  Prism own;             ///< over the diamond's own triangles
};

/// Judges a diamond by its triangles that are there. One that is nothing but void, or out of view, has no
/// sight, and no size on screen.
Judgement judge(const SelectionContext& context, KnownTiles& tiles, const Pieces& pieces);

}  // namespace terrane
