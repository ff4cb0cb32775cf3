#pragma once

#include "terrane/codec/tile.h"

namespace terrane {

/// Sizes the child's samples and spreads the parent's samples of a quadrant to every second place; the
/// others have any height, and are Coded for now.
void copyParentSamples(const TileSamples& parent, int quadrant, TileSamples& child);

/// Gives the samples of half-size s the means of their ends, and states as interpolateSamples() has them.
void interpolateLevel(int s, TileSamples& samples);

}  // namespace terrane
