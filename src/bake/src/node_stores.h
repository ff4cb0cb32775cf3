#pragma once

#include <array>
#include <cstdint>

#include "block_store.h"
#include "leaf_surfaces.h"
#include "terrane/tiling/node_layout.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

inline constexpr auto kMostNodes = static_cast<size_t>(tileNodeCount(true));
inline constexpr auto kMostLargeNodes = static_cast<size_t>(tileLargeNodeCount(true));
inline constexpr auto kQuads = static_cast<size_t>(nodeCount(8));

/// The errors of patches of coarser tiles, as far as they lie in one tile of level L: what it tells the tile
/// above. Metres; 0 where nothing was measured.
struct RisingErrors {
  static constexpr int kDepths = 7;  ///< bintree levels 2 L to 2 L + 6
  /// The tile's triangles of bintree level 2 L + depth, in the order of TileBisection.
  float* atDepth(int depth) { return inner.data() + (size_t{2} << depth) - 2; }
  const float* atDepth(int depth) const { return inner.data() + (size_t{2} << depth) - 2; }

  std::array<float, (size_t{2} << kDepths) - 2> inner{};
  /// The triangles of bintree levels below 2 L that hold the tile's two halves.
  std::array<std::array<float, 2>, 2 * static_cast<size_t>(kMaxLevel)> coarse{};
};

/// What was measured over one tile, as far as nothing stored refines it.
struct MeasuredNodes {
  std::array<float, kMostNodes> error{};  ///< of the tile's own nodes
  std::array<float, kQuads> low{};        ///< under its quads (node level 8), over ground; low > high: none
  std::array<float, kQuads> high{};
  RisingErrors rising;
};

/// The same of the tile and all below it.
struct GatheredNodes {
  std::array<float, kMostNodes> error{};
  RisingErrors rising;
};

/// The codes of a tile's nodes (TileNodes, in an array of fixed size).
struct TileCodes {
  std::array<uint8_t, kMostNodes> error{};
  std::array<uint8_t, kMostLargeNodes> large{};
  std::array<uint16_t, kMostNodes> low{};
  std::array<uint16_t, kMostNodes> high{};
};

/// What the steps that measure and code nodes keep for each tile.
struct NodeStores {
  explicit NodeStores(const Scratch& scratch)
      : measured(sizeof(MeasuredNodes), scratch, "measured"),
        gathered(sizeof(GatheredNodes), scratch, "gathered"),
        alone(sizeof(TileCodes), scratch, "codes-alone"),
        joined(sizeof(TileCodes), scratch, "codes") {}

  BlockStore measured;
  BlockStore gathered;
  BlockStore alone;   ///< codes before tiles agree on their common borders
  BlockStore joined;  ///< final codes
};

}  // namespace terrane
