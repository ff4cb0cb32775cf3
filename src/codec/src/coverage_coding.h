#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/tile.h"

/// A tile's coverage <-> a segment of answers, where it does not follow from the samples' states
/// (docs/format/elevation-v4.md, "Coverage").
namespace terrane {

/// Which cells have four corners that are ground.
std::vector<uint8_t> coverageFromCorners(const std::vector<SampleState>& states);

/// Appends the segment. Precondition: a partial coverage.
void encodeCoverage(const TileSamples& samples, std::vector<uint8_t>& out);

/// Reads it into samples.coverage; the states must be there. Gives the number of bytes used.
Result<size_t> decodeCoverage(std::span<const uint8_t> bytes, TileSamples& samples);

}  // namespace terrane
