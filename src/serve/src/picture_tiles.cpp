#include "picture_tiles.h"

namespace terrane::serve {

Result<std::shared_ptr<const ImageryTile>> PictureTiles::get(size_t layer, TileId id) {
  const Key key{layer, id};
  {
    const std::lock_guard lock(mutex_);
    const auto at = places_.find(key);
    if (at != places_.end()) {
      kept_.splice(kept_.begin(), kept_, at->second);
      return at->second->tile;
    }
  }
  // note: two threads that miss the same tile both decode it.
  TERRANE_ASSIGN(const auto payload, dataset_.readImagery(layer, id));
  std::shared_ptr<const ImageryTile> tile;
  if (payload) {
    TERRANE_ASSIGN(ImageryTile decoded, decodeImagery(*payload));
    tile = std::make_shared<const ImageryTile>(std::move(decoded));
  }
  const std::lock_guard lock(mutex_);
  if (places_.find(key) != places_.end()) return tile;
  kept_.push_front({key, tile});
  places_[key] = kept_.begin();
  while (kept_.size() > capacity_) {
    places_.erase(kept_.back().key);
    kept_.pop_back();
  }
  return tile;
}

}  // namespace terrane::serve
