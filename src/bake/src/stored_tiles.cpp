#include "stored_tiles.h"

#include <algorithm>
#include <utility>

#include "terrane/codec/all_layers.h"
#include "terrane/codec/elevation_codec.h"

namespace terrane {

Result<std::shared_ptr<const StoredTile>> StoredTiles::read(TileId id) {
  const auto found =
      std::find_if(kept_.begin(), kept_.end(), [&](const auto& kept) { return kept->id == id; });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
    return kept_.front();
  }

  std::shared_ptr<const StoredTile> parent;
  if (!id.isRoot()) {
    TERRANE_ASSIGN(parent, read(id.parent()));
  }
  const int quadrant = id.isRoot() ? 0 : id.quadrant();
  auto made = std::make_shared<StoredTile>();
  made->id = id;
  TERRANE_ASSIGN(auto payloads, dataset_.readAllLayers(id));
  if (payloads) {
    auto tile = decodeAllLayers(*payloads, parent ? &parent->tile.samples : nullptr, quadrant,
                                dataset_.manifest().scale);
    if (!tile.ok()) {
      return makeError("{}: tile {}: {}; build the dataset again", dataset_.directory(), toString(id),
                       tile.error().message);
    }
    made->payloads = std::move(*payloads);
    made->tile = std::move(tile).value();
  } else if (parent) {
    // note: not interpolateTile(), for which a quadrant without ground is void up to its border: a sample by
    // itself is no ground, and yet one of the source's.
    made->tile.samples = interpolateSamples(parent->tile.samples, quadrant);
  } else {
    return makeError("{}: has no tile {}; build the dataset again", dataset_.directory(), toString(id));
  }
  if (kept_.size() >= kKept) kept_.pop_back();
  kept_.push_front(std::move(made));
  return kept_.front();
}

}  // namespace terrane
