#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/dataset/dataset.h"
#include "terrane/engine/tile_meshes.h"
#include "terrane/lod/select_patches.h"

namespace terrane {

/// The decoded tiles of a dataset that are in memory: what selection calls resident. Nothing leaves by
/// itself. One thread at a time.
class TilePool final : public ResidentTiles {
 public:
  /// `dataset` must outlive the pool.
  explicit TilePool(const Dataset& dataset)
      : dataset_(dataset), meshes_(dataset.manifest().frame, dataset.manifest().scale) {}

  const Tile* find(TileId id) const override;
  const MeshLevel* findMeshes(TileId id, int level) const override { return meshes_.find(id, level); }

  /// Makes what a cut wishes for, on all cores.
  void makeMeshes(std::span<const MeshWish> wishes);
  const TileMeshes& meshes() const { return meshes_; }

  /// Reads tiles whose parents are resident, together, and decodes them on all cores; tiles that are resident
  /// already are left alone. Errors name the tile; tiles before the faulty one may have been added.
  Status load(std::span<const TileId> ids);

  /// A tile's samples: the resident one's, or, below what is stored, those that interpolation gives. Its
  /// nearest stored ancestor must be resident. Implied tiles are kept as well.
  const Tile& findOrImply(TileId id);

  size_t residentTiles() const { return stored_.size(); }
  uint64_t residentBytes() const;
  /// Bytes of tiles that have been read from the dataset.
  uint64_t bytesRead() const { return bytesRead_; }
  void clear();

 private:
  Status loadMissing(std::span<const TileId> missing);

  const Dataset& dataset_;
  std::unordered_map<TileId, std::unique_ptr<Tile>, TileIdHash> stored_;
  std::unordered_map<TileId, std::unique_ptr<Tile>, TileIdHash> implied_;
  TileMeshes meshes_;
  uint64_t bytesRead_ = 0;
};

}  // namespace terrane
