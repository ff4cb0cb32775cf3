#include "tile_decoding.h"

#include <mutex>

#include "terrane/stream/decode_orders.h"

namespace terrane {
namespace {

/// The decoded tile with all its layers of significance that are here; null if it is not.
std::shared_ptr<const Tile> tileOf(const TileShelf& shelf, const TileKey& key) {
  const ShelfEntry* entry = shelf.find(key);
  return entry == nullptr ? nullptr : entry->tile;
}

/// Completes an order by the parent that all tiles but a root need. Returns whether it is decoded.
template <class Order>
bool giveParent(Order& order, const TileKey& key, const TileShelf& shelf) {
  if (key.tile.isRoot()) return true;
  const std::shared_ptr<const Tile> above = tileOf(shelf, key.parent());
  if (above == nullptr) return false;
  order.parent = {above, &above->samples};
  order.quadrant = key.tile.quadrant();
  return true;
}

}  // namespace

/// What the workers have made. They keep it alive, whatever happened to the stream meanwhile.
struct TileDecoding::Finished {
  std::mutex mutex;
  std::vector<Made> made;
};

/// Puts what was decoded where takeMade() finds it; any thread.
struct TileDecoding::Taker {
  std::shared_ptr<Finished> finished;
  TileKey key;
  std::string where;
  bool isSketch = false;
  std::shared_ptr<const Tile> before = nullptr;  ///< of a refinement, which leaves all but samples as is

  void operator()(Result<TileSamples> samples) const {
    Made made = begun();
    if (samples.ok())
      made.tile = std::make_shared<const Tile>(Tile{std::move(*samples), before->nodes, before->children});
    else
      made.problem = fmt::format("{}: layer {} of tile {}: {}", where, key.significance(), toString(key.tile),
                                 samples.error().message);
    hand(std::move(made));
  }
  void operator()(Result<Tile> tile) const {
    Made made = begun();
    if (tile.ok())
      made.tile = std::make_shared<const Tile>(std::move(*tile));
    else
      made.problem = fmt::format("{}: tile {}: {}", where, toString(key.tile), tile.error().message);
    hand(std::move(made));
  }
  void operator()(Result<ImageryTile> picture) const {
    Made made = begun();
    if (picture.ok())
      made.picture = std::make_shared<const ImageryTile>(std::move(*picture));
    else
      made.problem =
          fmt::format("{}: imagery tile {}: {}", where, toString(key.tile), picture.error().message);
    hand(std::move(made));
  }

 private:
  Made begun() const { return {.key = key, .tile = {}, .picture = {}, .problem = {}, .isSketch = isSketch}; }
  void hand(Made made) const {
    const std::lock_guard lock(finished->mutex);
    finished->made.push_back(std::move(made));
  }
};

TileDecoding::TileDecoding(Workers& workers, const Archives& archives, const TileShelf& shelf,
                           std::string where)
    : workers_(workers),
      archives_(archives),
      shelf_(shelf),
      where_(std::move(where)),
      finished_(std::make_shared<Finished>()) {}

TileDecoding::Taker TileDecoding::takerOf(const TileKey& key, bool isSketch) const {
  return {finished_, key, where_, isSketch, nullptr};
}

bool TileDecoding::start(const TileKey& key, const ShelfEntry& entry) {
  if (key.isRefinement()) return startRefinement(key, entry);
  if (key.isElevation()) return startElevation(key, entry);
  ++underway_;
  workers_.order(DecodePicture{entry.payload, false}, takerOf(key, false));
  return true;
}

bool TileDecoding::startElevation(const TileKey& key, const ShelfEntry& entry) {
  DecodeElevation order{entry.payload, nullptr, 0, archives_.manifest().scale};
  if (!giveParent(order, key, shelf_)) return false;
  ++underway_;
  // note: before the root there is nothing to draw, and its way to a worker and back takes longer than it.
  if (key.tile.isRoot())
    takerOf(key, false)(order.run());
  else
    workers_.order(std::move(order), takerOf(key, false));
  return true;
}

bool TileDecoding::startRefinement(const TileKey& key, const ShelfEntry& entry) {
  const std::shared_ptr<const Tile> before = tileOf(shelf_, key.before());
  if (before == nullptr) return false;
  RefineElevation order{entry.payload, {before, &before->samples}, nullptr, 0, archives_.manifest().scale};
  if (!giveParent(order, key, shelf_)) return false;
  ++underway_;
  Taker taker = takerOf(key, false);
  taker.before = before;
  workers_.order(std::move(order), std::move(taker));
  return true;
}

void TileDecoding::startSketch(const TileKey& key, const ShelfEntry& entry) {
  ++underway_;
  auto beginning = std::make_shared<const std::vector<uint8_t>>(entry.beginning);
  if (key.isElevation())
    workers_.order(SketchElevation{std::move(beginning), archives_.manifest().scale}, takerOf(key, true));
  else
    workers_.order(DecodePicture{std::move(beginning), true}, takerOf(key, true));
}

std::vector<TileDecoding::Made> TileDecoding::takeMade() {
  const std::lock_guard lock(finished_->mutex);
  underway_ -= static_cast<int>(finished_->made.size());
  return std::exchange(finished_->made, {});
}

}  // namespace terrane
