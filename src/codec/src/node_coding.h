#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/tile.h"

/// A tile's node codes <-> a segment of entropy-coded differences to what its samples, and the codes before,
/// let one expect (docs/format/elevation-v4.md, "Nodes").
namespace terrane {

/// A height range is empty in one way only.
inline bool isRange(uint16_t low, uint16_t high) {
  return low <= high || (low == 65535 && high == 0);
}

/// Appends the segment.
void encodeNodes(const Tile& tile, const ElevationScale& scale, bool isRoot, std::vector<uint8_t>& out);

/// Reads it into tile.nodes; the tile's samples and children must be there. Gives the number of bytes used.
Result<size_t> decodeNodes(std::span<const uint8_t> bytes, const ElevationScale& scale, bool isRoot,
                           Tile& tile);

}  // namespace terrane
