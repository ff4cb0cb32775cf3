#pragma once

#include <vector>

#include "terrane/codec/tile.h"

namespace terrane {

/// Sizes the child's samples and spreads the parent's samples of a quadrant to every second place; the
/// others have any height, and one state for now.
void copyParentSamples(const TileSamples& parent, int quadrant, SampleState others, TileSamples& child);

/// Gives the samples of half-size s the means of their ends.
void interpolateHeights(int s, std::vector<float>& heights);
/// Gives the samples of half-size s the means of their ends, and states as interpolateSamples() has them.
void interpolateLevel(int s, TileSamples& samples);

}  // namespace terrane
