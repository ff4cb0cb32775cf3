#pragma once

#include "judgement.h"
#include "known_tiles.h"
#include "selection_context.h"
#include "split.h"
#include "terrane/tiling/lattice.h"

namespace terrane {

/// The error, in metres, of the patches that a diamond's split makes while they are at morph 0.
double startErrorMeters(const SelectionContext& context, const Judgement& judged,
                        const SplitChildren& children);

/// How far the patches that a diamond's split makes have become themselves, as far as the camera asks for
/// them, 0 to 1. By when a child splits this is 1, whichever of the two it splits for. The children's tiles
/// are here.
double morphOf(const SelectionContext& context, KnownTiles& tiles, const Diamond& d, const Judgement& judged,
               double startMeters, const SplitChildren& children);

}  // namespace terrane
