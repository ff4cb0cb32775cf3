#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/strip_mesh.h"

/// The heights of a tile as a strip mesh's vertices have them: a number of bits that suits the tile's range.
namespace terrane {

struct StripHeights {
  int bits = 0;
  double baseMeters = 0.0;
  double stepMeters = 0.0;
  std::vector<float> known;  ///< as they were given, NaN for what is not finite
  std::vector<uint16_t> q;   ///< baseMeters + q * stepMeters is the height of a vertex; of all samples
};

/// k = max(ceil(log2(range / (2 quantisation))), 0) bits: the range in 2^k steps, a height is the middle of
/// its step. What is not known takes the height of what is, in its row, or of another row. Error: more bits
/// than a vertex has.
Result<StripHeights> quantizeStripHeights(std::span<const float> heights, int side,
                                          const StripMeshOptions& options);

}  // namespace terrane
