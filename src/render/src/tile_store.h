#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "prepared_tile.h"
#include "terrane/base/result.h"
#include "terrane/codec/tile.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/program.h"
#include "terrane/gpu/texture.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

/// Layer numbers that are free or taken.
class LayerPool {
 public:
  /// A free layer: one that was given back, else the first that was never taken.
  int take();
  void giveBack(int layer) { free_.push_back(layer); }
  int highest() const { return next_; }  ///< one more than the highest layer ever taken

 private:
  std::vector<int> free_;
  int next_ = 0;
};

/// The tiles on the GPU: heights, gradients for lighting, and coverage, each a layer of a texture array.
class TileStore {
 public:
  /// Where a tile's data lie.
  struct Entry {
    int layer = 0;           ///< of heights and gradients
    int coverageLayer = -1;  ///< -1 where the coverage needs none
    Coverage::Kind coverage = Coverage::Kind::None;
    uint8_t staleSides =
        0;  ///< bit per Side: border gradients to be made anew, since neighbours came or went
    BorderGradients borders;
  };

  explicit TileStore(const gpu::Context& context);

  /// Room for so many tiles, whatever their coverage.
  Status reserve(int tiles);
  /// Puts a tile there, replacing one of the same address.
  Status upload(TileId id, const TileSamples& samples, const PreparedTile& prepared);
  void drop(TileId id);
  const Entry* find(TileId id) const;
  size_t tileCount() const { return tiles_.size(); }
  size_t gpuBytes() const { return heights_.sizeBytes() + gradients_.sizeBytes() + coverage_.sizeBytes(); }

  /// Makes the gradients on the borders of neighbours agree. Before drawing; costs nothing when no tile came
  /// or went.
  void refreshBorders();
  /// Binds the arrays to texture units.
  void bind() const;
  /// Lets a program whose vertex stage is patch.vert read from those units.
  static void setSamplers(const gpu::Program& program);

 private:
  void markAround(TileId id);
  void refreshSide(TileId id, const Entry& entry, Side side);
  Gradient sharedGradient(TileId id, const Entry& entry, Side side, int level, int index) const;

  const gpu::Context& context_;
  gpu::TextureArray heights_;
  gpu::TextureArray gradients_;
  gpu::TextureArray coverage_;
  LayerPool layers_;
  LayerPool coverageLayers_;
  std::unordered_map<TileId, Entry, TileIdHash> tiles_;
  /// What find() gave last, and for which tile: patches of a tile mostly follow each other.
  mutable const Entry* last_ = nullptr;
  mutable TileId lastId_;
  std::vector<TileId> stale_;
};

}  // namespace terrane
