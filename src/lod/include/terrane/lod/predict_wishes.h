#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "terrane/lod/select_patches.h"

namespace terrane {

/// The tiles below the wished ones that will most likely be wished next, once those are here: with them a
/// client fetches a whole chain of descendants in one round trip.
///
/// A guess. Errors are taken to halve with each tile level, beginning with those of `wishes` and with what
/// resident parents know of the wished tiles; heights are those known of the nearest ancestor. A tile is
/// named if its square, as high as that, is in view, and the guess asks for what it holds: more than tau of
/// error, or larger texels than shading wants. Never one that is resident, wished, or not `isStored`; always
/// after its parent, which is named or wished. At most `most`, those with most error first; only for
/// SplitMetric::Full.
///
/// Of SurfaceKind::Meshes no mesh states a smaller error than its level's bound, so all that will be wished
/// for is found from the root on, also where meshes that are not made yet, or fade in, keep it from being
/// wished for.
///
/// Cost: about a microsecond a tile looked at, at most four for each one named.
std::vector<TileWish> predictWishes(std::span<const TileWish> wishes, const PatchSelection& selection,
                                    const Frame& frame, const ElevationScale& scale, const Camera& camera,
                                    const ResidentTiles& tiles, const std::function<bool(TileId)>& isStored,
                                    size_t most);

}  // namespace terrane
