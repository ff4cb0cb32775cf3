#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/program.h"
#include "terrane/gpu/texture.h"
#include "terrane/tiling/lattice.h"
#include "terrane/tiling/tile_id.h"
#include "tile_store.h"

namespace terrane {

/// Imagery tiles on the GPU, each a layer of a texture array with one texel of border, and the page table
/// that tells fragments which of them lie over a patch.
class ImageryStore {
 public:
  static constexpr int kSideBits = 8;
  static constexpr int kSide = 1 << kSideBits;
  static constexpr int kBordered = kSide + 2;
  /// A page knows its finest level and up to this many coarser ones.
  static constexpr int kCoarserLevels = 5;
  /// A page spans at most this many tiles of its finest level along a side.
  static constexpr int64_t kMostTilesAcross = 32;

  explicit ImageryStore(const gpu::Context& context);

  /// Room for so many tiles.
  Status reserve(int tiles) { return texels_.reserve(context_, tiles, gpu::Growth::Exact); }
  /// Replaces some texels of a tile that has a picture.
  void update(TileId id, const gpu::TexelRect& rect, std::span<const uint8_t> rgba);
  /// kBordered x kBordered texels, or none: there is no picture on this tile.
  Status upload(TileId id, std::span<const uint8_t> rgba);
  void drop(TileId id);
  bool has(TileId id) const { return layers_.count(id) != 0; }
  size_t tileCount() const { return layers_.size(); }
  size_t gpuBytes() const { return texels_.sizeBytes() + pages_.sizeBytes(); }

  /// Begins the pages of a frame. Those of the frame before are still there: a page stays the same as long as
  /// no tile comes or goes.
  void beginPages();
  /// The page of a patch whose shading tile is `shading`: a number for the shader, -1 where there is no
  /// imagery. The tile's ancestors must be here where the tile is.
  int32_t addPage(const Lattice& lattice, const Triangle& triangle, TileId shading);
  /// Hands the pages that are new to the GPU.
  Status finishPages();

  void bind() const;
  static void setSamplers(const gpu::Program& program);

 private:
  using Entry = std::array<float, 4>;
  struct Range {
    int64_t firstCol, firstRow, endCol, endRow;
  };
  /// The nearest tile upwards that is here, itself included.
  std::optional<TileId> nearest(TileId id) const;
  int32_t makePage(const Lattice& lattice, const Triangle& triangle, TileId shading);

  /// What a page follows from, as long as no tile comes or goes.
  struct Known {
    Triangle triangle;
    TileId shading;
    int32_t depth = 0;  ///< of the lattice
    int32_t page = -1;
    bool operator<(const Known& other) const;
    bool isOf(const Known& other) const {
      return triangle == other.triangle && shading == other.shading && depth == other.depth;
    }
  };

  const gpu::Context& context_;
  gpu::TextureArray texels_;
  gpu::TextureArray pages_;
  LayerPool pool_;
  std::unordered_map<TileId, int, TileIdHash> layers_;   ///< -1: no picture
  std::unordered_map<TileId, int, TileIdHash> deepest_;  ///< level of the deepest tile at or below it
  bool isChanged_ = true;  ///< tiles have come or gone since the last pages were begun
  /// The pages of this frame and of the one before, in the order in which they were added: as cuts have
  /// their patches in the same order from frame to frame, the two are gone through side by side.
  std::vector<Known> drawn_, before_;
  size_t nextBefore_ = 0;
  size_t made_ = 0;  ///< pages that are in entries_, drawn or not
  std::vector<Entry> entries_;
  size_t uploadedEntries_ = 0;  ///< of entries_, the first so many
};

}  // namespace terrane
