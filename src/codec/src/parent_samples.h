#pragma once

#include <vector>

#include "terrane/codec/tile.h"

namespace terrane {

/// Sizes the child's samples and spreads the parent's samples of a quadrant to every second place; the
/// others have any height, and one state for now.
void copyParentSamples(const TileSamples& parent, int quadrant, SampleState others, TileSamples& child);

/// The parent's layers likewise; `child` has places for them.
void copyParentLayers(const TileSamples& parent, int quadrant, TileSamples& child);
/// Precondition that samples which both hold are the same: the decoder takes them from the parent.
void checkParentSamples(const TileSamples& samples, const TileSamples& parent, int quadrant);

/// Gives the samples of half-size s the means of their ends.
void interpolateHeights(int s, std::vector<float>& heights);
/// Gives the samples of half-size s the means of their ends, and states as interpolateSamples() has them.
void interpolateLevel(int s, TileSamples& samples);

/// Gives those of half-size s that are not Coded the means of their ends.
void interpolateOthers(int s, TileSamples& samples);

}  // namespace terrane
