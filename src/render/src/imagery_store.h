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

  /// Begins the pages of a frame.
  void beginPages();
  /// The page of a patch whose shading tile is `shading`: a number for the shader, -1 where there is no
  /// imagery. The tile's ancestors must be here where the tile is.
  int32_t addPage(const Lattice& lattice, const Triangle& triangle, TileId shading);
  /// Hands the pages to the GPU.
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

  const gpu::Context& context_;
  gpu::TextureArray texels_;
  gpu::TextureArray pages_;
  LayerPool pool_;
  std::unordered_map<TileId, int, TileIdHash> layers_;   ///< -1: no picture
  std::unordered_map<TileId, int, TileIdHash> deepest_;  ///< level of the deepest tile at or below it
  std::vector<Entry> entries_;
};

}  // namespace terrane
