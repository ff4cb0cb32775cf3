#include "terrane/engine/imagery_pool.h"

#include <algorithm>
#include <optional>
#include <unordered_set>

#include "imagery_compose.h"
#include "imagery_selection.h"
#include "terrane/base/parallel.h"

namespace terrane {

namespace {

/// Tiles that are kept beyond those of the frame.
constexpr size_t kSpareTiles = 500;

}  // namespace

ImageryPool::ImageryPool(const Dataset& dataset, const std::vector<size_t>& layers) : dataset_(&dataset) {
  for (const size_t index : layers) {
    Layer layer{index, dataset.manifest().imagery[index].finestLevel, dataset.imageryTiles(index)};
    std::sort(layer.tiles.begin(), layer.tiles.end());
    layers_.push_back(std::move(layer));
  }
}

bool ImageryPool::Layer::has(TileId id) const {
  return std::binary_search(tiles.begin(), tiles.end(), id);
}

bool ImageryPool::hasDeeper(TileId id) const {
  for (const Layer& layer : layers_) {
    for (int quadrant = 0; id.level < layer.finestLevel && quadrant < 4; ++quadrant)
      if (layer.has(id.child(quadrant))) return true;
  }
  return false;
}

std::vector<TileId> ImageryPool::tilesFor(const Camera& camera, double exaggeration,
                                          const TilePool& heights) const {
  std::vector<TileId> out;
  if (layers_.empty()) return out;
  const ImageryView view{camera, exaggeration, dataset_->manifest(), heights,
                         [this](TileId id) { return hasDeeper(id); }};
  for (const ImageryNeed& need : selectImagery(view, kMostTiles)) out.push_back(need.tile);
  return out;
}

Status ImageryPool::load(std::span<const TileId> ids) {
  std::vector<TileId> missing;
  for (const TileId id : ids)
    if (tiles_.count(id) == 0) missing.push_back(id);
  if (tiles_.size() + missing.size() > ids.size() + kSpareTiles) {
    const std::unordered_set<TileId, TileIdHash> needed(ids.begin(), ids.end());
    for (auto at = tiles_.begin(); at != tiles_.end();)
      at = needed.count(at->first) != 0 ? std::next(at) : tiles_.erase(at);
  }
  TERRANE_ASSIGN(const std::vector<Payloads> payloads, readFor(missing));
  std::vector<std::optional<Result<std::unique_ptr<ImageryTile>>>> made(missing.size());
  parallelFor(static_cast<int64_t>(missing.size()), 0, [&](int64_t index) {
    const auto i = static_cast<size_t>(index);
    made[i] = make(missing[i], payloads);
  });
  for (size_t i = 0; i < missing.size(); ++i) {
    if (!made[i]->ok())
      return makeError("{}: imagery tile {}: {}", dataset_->directory(), toString(missing[i]),
                       made[i]->error().message);
    tiles_[missing[i]] = std::move(**made[i]);
  }
  return {};
}

TileId ImageryPool::Layer::storedFor(TileId id) const {
  return id.ancestor(id.level - std::max(0, id.level - finestLevel));
}

Result<std::vector<ImageryPool::Payloads>> ImageryPool::readFor(std::span<const TileId> ids) {
  std::vector<Payloads> out;
  for (const Layer& layer : layers_) {
    // Tiles that are enlarged from the same one read it once.
    std::vector<TileId> stored;
    for (const TileId id : ids)
      if (layer.has(layer.storedFor(id))) stored.push_back(layer.storedFor(id));
    std::sort(stored.begin(), stored.end());
    stored.erase(std::unique(stored.begin(), stored.end()), stored.end());
    TERRANE_ASSIGN(auto read, dataset_->readImagery(layer.index, stored));
    Payloads& payloads = out.emplace_back();
    for (size_t i = 0; i < stored.size(); ++i) {
      if (!read[i]) continue;
      bytesRead_ += read[i]->size();
      payloads.emplace(stored[i], std::move(*read[i]));
    }
  }
  return out;
}

Result<std::unique_ptr<ImageryTile>> ImageryPool::make(TileId id,
                                                       const std::vector<Payloads>& payloads) const {
  std::unique_ptr<ImageryTile> out;
  for (size_t i = 0; i < layers_.size(); ++i) {
    // Beyond its finest level a layer is enlarged.
    const TileId stored = layers_[i].storedFor(id);
    const auto payload = payloads[i].find(stored);
    if (payload == payloads[i].end()) continue;
    TERRANE_ASSIGN(ImageryTile tile, decodeImagery(payload->second));
    if (stored.level < id.level) tile = enlargeImagery(tile, id.level - stored.level, id);
    if (out == nullptr)
      out = std::make_unique<ImageryTile>(std::move(tile));
    else
      layImageryOver(*out, tile);
  }
  if (out != nullptr && layers_.size() > 1 && coverOf(*out) == ImageryCover::Partial) fillTransparent(*out);
  return out;
}

const ImageryTile* ImageryPool::find(TileId id) const {
  const auto at = tiles_.find(id);
  return at == tiles_.end() ? nullptr : at->second.get();
}

std::vector<uint8_t> ImageryPool::bordered(TileId id) const {
  return borderedImagery(id, [this](TileId at) { return find(at); });
}

}  // namespace terrane
