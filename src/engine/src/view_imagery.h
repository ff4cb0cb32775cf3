#pragma once

#include <cstdint>
#include <memory>
#include <string>
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
  /// The layers that count, by their names; at first all. Pictures of others stay until theirs are made.
  void setLayers(const std::vector<std::string>& names);
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
  bool isCurrent(TileId id) const { return resident_.has(id) && stale_.count(id) == 0; }
  bool isLayerShown() const;
  void drop(TileId id);
  /// Drops what shows other layers than it should and is not needed now.
  void dropStale();
  /// Composes residents of a set anew, as their parts come. Returns whether anything changed.
  Result<bool> recompose(std::unordered_set<TileId, TileIdHash>& which, bool mayBeSketches,
                         uint64_t budgetBytes, uint64_t& spent);
  void wish(const ImageryNeed& need, double chance, std::vector<StreamWish>& wishes) const;

  const TileStream& stream_;
  TerrainRenderer* renderer_;
  bool shown_ = true;
  std::vector<bool> layers_;  ///< that count
  ResidentSet resident_;
  std::vector<ImageryNeed> needs_;
  std::unordered_map<TileId, std::shared_ptr<const ImageryTile>, TileIdHash> pictures_;  ///< of residents
  std::unordered_set<TileId, TileIdHash> sketched_;  ///< residents of which parts were sketches
  std::unordered_set<TileId, TileIdHash> stale_;     ///< residents that show other layers than they should
  uint64_t uploaded_ = 0;
};

}  // namespace terrane
