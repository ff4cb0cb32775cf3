#pragma once

#include <optional>
#include <vector>

#include "node_stores.h"
#include "pyramid.h"
#include "stored_tiles.h"
#include "terrane/bake/source.h"
#include "terrane/dataset/manifest.h"

namespace terrane {

/// A tile's bytes for the archive.
struct EncodedTile {
  std::vector<uint8_t> bytes;
  bool copied = false;  ///< from the dataset that the build adds to
};

/// Turns tiles into payloads, each worker with a parent at hand.
class TileEncoder {
 public:
  /// `manifest`: the one of the dataset that is made, with its scale. `base`: the dataset that is added to,
  /// or null. All must outlive this.
  TileEncoder(const Pyramid& pyramid, const NodeStores& stores, const Manifest& manifest,
              const AppendBase* base, int workers);

  /// The payload of a layer of significance of a stored tile. Where the old dataset's tile and its parent
  /// hold the very same, it is that one's, without being encoded again.
  Result<EncodedTile> encode(int worker, TileId id, int layer);

 private:
  struct Scratch {
    Tile tile;
    TileSamples parent;
    TileId parentId{-1, 0, 0};
    TileCodes codes;
    std::optional<StoredTiles> before;
  };

  Status takeNodes(const PyramidTile& tile, TileCodes& codes, TileNodes& out) const;
  ChildSummary summariseChild(const PyramidTile& tile, const Tile& out, int quadrant) const;
  Result<std::vector<uint8_t>> payloadBefore(Scratch& scratch, TileId id, int layer) const;

  const Pyramid& pyramid_;
  const NodeStores& stores_;
  const ElevationScale& scale_;
  std::vector<Scratch> scratches_;
};

}  // namespace terrane
