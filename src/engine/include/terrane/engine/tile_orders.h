#pragma once

#include <memory>
#include <vector>

#include "terrane/engine/tile_meshes.h"
#include "terrane/render/prepare_tile.h"
#include "terrane/stream/work.h"

/// The orders that make of decoded tiles what is drawn (stream/work.h).
namespace terrane {

/// prepareTile().
struct PrepareTile {
  static constexpr uint32_t kKind = 16;
  using Answer = std::shared_ptr<const PreparedTile>;
  std::shared_ptr<const Tile> tile;

  Answer run() const { return prepareTile(tile->samples); }
  void pack(Packer& packer) const;
  static PrepareTile unpack(Unpacker& unpacker);
  static void packAnswer(Packer& packer, const Answer& answer);
  static Answer unpackAnswer(Unpacker& unpacker);
};

/// TileMeshes::make().
struct MakeMeshes {
  static constexpr uint32_t kKind = 17;
  using Answer = std::vector<std::shared_ptr<const MeshLevel>>;
  TileMeshes::Order order;
  std::shared_ptr<const Tile> tile;

  Answer run() const { return TileMeshes::make(order, *tile); }
  /// Takes along what makeMeshLevel() reads: the tile, if it is not there, and vertices of the level before.
  void pack(Packer& packer) const;
  static MakeMeshes unpack(Unpacker& unpacker);
  static void packAnswer(Packer& packer, const Answer& answer);
  static Answer unpackAnswer(Unpacker& unpacker);
};

}  // namespace terrane
