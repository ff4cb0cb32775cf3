#pragma once

#include <cstdint>
#include <memory>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "imagery_selection.h"
#include "resident_set.h"
#include "terrane/render/terrain_renderer.h"
#include "terrane/stream/tile_stream.h"

namespace terrane {

/// The imagery of a streaming view: chooses tiles, wishes for their layers' parts, lays these over each other
/// and puts them on the GPU.
class ViewImagery {
 public:
  /// All must outlive it; `renderer` may be null. `capacity`: tiles on the GPU.
  ViewImagery(const TileStream& stream, TerrainRenderer* renderer, size_t capacity);

  void setShown(bool shown);
  /// What a camera needs. Marks what is on the GPU of it as needed.
  void choose(const Camera& camera, double exaggeration, const ResidentTiles& heights, uint64_t frame);
  /// Adds what is missing of that choice.
  void addWishes(std::vector<StreamWish>& wishes) const;
  /// Adds what another camera needs beyond, with a chance that it will.
  void addPrefetch(const Camera& camera, double exaggeration, const ResidentTiles& heights, double chance,
                   std::vector<StreamWish>& wishes) const;
  /// Uploads what has come, within `budgetBytes`, at least one tile. Returns whether anything changed.
  Result<bool> upload(uint64_t budgetBytes, uint64_t frame);

  bool isSettled() const;
  size_t onGpu() const { return resident_.size(); }
  uint64_t uploaded() const { return uploaded_; }

 private:
  /// A layer's part of a tile: a stored tile, `up` levels above.
  struct Part {
    TileKey key;
    int up = 0;
  };
  std::vector<Part> partsOf(TileId id) const;
  bool hasDeeper(TileId id) const;
  bool hasSketch(TileId id) const;
  /// Puts a resident's picture on the GPU, replacing the one before.
  Status put(TileId id);
  /// The tile's picture if all its parts are here or will not come: null where there is none.
  bool compose(TileId id, std::shared_ptr<const ImageryTile>& out) const;
  const ImageryTile* composed(TileId id) const;
  void refreshNeighbours(TileId id);
  void wish(const ImageryNeed& need, double chance, std::vector<StreamWish>& wishes) const;

  const TileStream& stream_;
  TerrainRenderer* renderer_;
  bool shown_ = true;
  ResidentSet resident_;
  std::vector<ImageryNeed> needs_;
  std::unordered_map<TileId, std::shared_ptr<const ImageryTile>, TileIdHash> pictures_;  ///< of residents
  std::unordered_set<TileId, TileIdHash> sketched_;  ///< residents of which parts were sketches
  uint64_t uploaded_ = 0;
};

}  // namespace terrane
