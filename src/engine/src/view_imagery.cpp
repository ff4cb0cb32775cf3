#include "view_imagery.h"

#include <algorithm>
#include <cmath>

#include "imagery_compose.h"

namespace terrane {
namespace {

/// What a pixel of blur is worth beside a pixel of geometric error.
constexpr double kBlurWeight = 0.3;

}  // namespace

ViewImagery::ViewImagery(const TileStream& stream, TerrainRenderer* renderer, size_t capacity)
    : stream_(stream),
      renderer_(renderer),
      shown_(capacity > 0 && !stream.manifest().imagery.empty()),
      layers_(stream.manifest().imagery.size(), true),
      resident_(std::max<size_t>(capacity, 1)) {}

bool ViewImagery::isLayerShown() const {
  return std::any_of(layers_.begin(), layers_.end(), [](bool is) { return is; });
}

void ViewImagery::drop(TileId id) {
  resident_.remove(id);
  pictures_.erase(id);
  sketched_.erase(id);
  stale_.erase(id);
  if (renderer_ != nullptr) renderer_->dropImagery(id);
}

void ViewImagery::setShown(bool shown) {
  shown_ = shown && !stream_.manifest().imagery.empty();
  if (shown_) return;
  while (!pictures_.empty()) drop(pictures_.begin()->first);
}

void ViewImagery::setLayers(const std::vector<std::string>& names) {
  const auto& known = stream_.manifest().imagery;
  std::vector<bool> wanted;
  wanted.reserve(known.size());
  for (const ImageryLayerRecord& layer : known)
    wanted.push_back(std::find(names.begin(), names.end(), layer.name) != names.end());
  if (wanted == layers_) return;
  layers_ = wanted;
  if (!isLayerShown()) {
    while (!pictures_.empty()) drop(pictures_.begin()->first);
    needs_.clear();
  }
  for (const auto& [id, picture] : pictures_) stale_.insert(id);
}

void ViewImagery::dropStale() {
  if (stale_.empty()) return;
  // note: what is needed is needed with its ancestors, so no tile loses one.
  std::vector<TileId> leaving;
  for (const auto& [id, picture] : pictures_) {
    const bool isNeeded =
        std::any_of(needs_.begin(), needs_.end(), [id = id](const auto& need) { return need.tile == id; });
    if (isNeeded) continue;
    bool isUnderStale = false;
    for (int level = 0; level <= id.level; ++level) isUnderStale |= stale_.count(id.ancestor(level)) != 0;
    if (isUnderStale) leaving.push_back(id);
  }
  for (const TileId id : leaving) drop(id);
}

std::vector<ViewImagery::Part> ViewImagery::partsOf(TileId id) const {
  std::vector<Part> out;
  const auto& layers = stream_.manifest().imagery;
  for (size_t i = 0; i < layers.size(); ++i) {
    if (!layers_[i]) continue;
    // Beyond its finest level a layer is enlarged.
    const int up = std::max(0, id.level - layers[i].finestLevel);
    const TileKey key{static_cast<int32_t>(i), id.ancestor(id.level - up)};
    if (stream_.isStored(key)) out.push_back({key, up});
  }
  return out;
}

bool ViewImagery::hasDeeper(TileId id) const {
  const auto& layers = stream_.manifest().imagery;
  for (size_t i = 0; i < layers.size(); ++i) {
    for (int quadrant = 0; layers_[i] && id.level < layers[i].finestLevel && quadrant < 4; ++quadrant)
      if (stream_.isStored({static_cast<int32_t>(i), id.child(quadrant)})) return true;
  }
  return false;
}

void ViewImagery::choose(const Camera& camera, double exaggeration, const ResidentTiles& heights,
                         uint64_t frame) {
  needs_.clear();
  if (!shown_ || !isLayerShown()) return;
  // Before anything is known of the ground, what a picture needs would be a guess.
  const bool knowsGround = heights.find(TileId{}) != nullptr;
  needs_ = selectImagery({camera, exaggeration, stream_.manifest(), heights,
                          [&](TileId id) { return knowsGround && hasDeeper(id); }},
                         resident_.capacity());
  for (const ImageryNeed& need : needs_) resident_.need(need.tile, frame);
  dropStale();
}

void ViewImagery::wish(const ImageryNeed& need, double chance, std::vector<StreamWish>& wishes) const {
  // Until it is here, its nearest ancestor's texels are seen.
  int above = 1;
  while (above < need.tile.level && !resident_.has(need.tile.ancestor(need.tile.level - above))) ++above;
  StreamWish wish;
  wish.nowPixels = need.texelPixels * std::ldexp(1.0, std::min(above, 8));
  wish.afterPixels = need.texelPixels;
  wish.areaPixels = kBlurWeight * need.areaPixels;
  wish.chance = chance;
  for (const Part& part : partsOf(need.tile)) {
    wish.key = part.key;
    wishes.push_back(wish);
  }
}

void ViewImagery::addWishes(std::vector<StreamWish>& wishes) const {
  for (const ImageryNeed& need : needs_)
    if (!isCurrent(need.tile)) wish(need, 1.0, wishes);
}

void ViewImagery::addPrefetch(const Camera& camera, double exaggeration, const ResidentTiles& heights,
                              double chance, std::vector<StreamWish>& wishes) const {
  if (!shown_ || !isLayerShown()) return;
  const ImageryView view{camera, exaggeration, stream_.manifest(), heights,
                         [this](TileId id) { return hasDeeper(id); }};
  for (const ImageryNeed& need : selectImagery(view, resident_.capacity()))
    if (!resident_.has(need.tile)) wish(need, chance, wishes);
}

bool ViewImagery::compose(TileId id, std::shared_ptr<const ImageryTile>& out) const {
  const std::vector<Part> parts = partsOf(id);
  std::vector<std::shared_ptr<const ImageryTile>> tiles;
  for (const Part& part : parts) {
    tiles.push_back(stream_.picture(part.key));
    if (tiles.back() == nullptr && !stream_.isLost(part.key)) return false;
  }
  out = nullptr;
  if (parts.size() == 1 && parts[0].up == 0) {
    out = tiles[0];
    return true;
  }
  std::shared_ptr<ImageryTile> made;
  for (size_t i = 0; i < parts.size(); ++i) {
    if (tiles[i] == nullptr) continue;
    ImageryTile tile = parts[i].up > 0 ? enlargeImagery(*tiles[i], parts[i].up, id) : *tiles[i];
    if (made == nullptr)
      made = std::make_shared<ImageryTile>(std::move(tile));
    else
      layImageryOver(*made, tile);
  }
  if (made != nullptr && parts.size() > 1 && coverOf(*made) == ImageryCover::Partial) fillTransparent(*made);
  out = made;
  return true;
}

const ImageryTile* ViewImagery::composed(TileId id) const {
  const auto at = pictures_.find(id);
  return at == pictures_.end() ? nullptr : at->second.get();
}

void ViewImagery::refreshNeighbours(TileId id) {
  const auto find = [this](TileId at) { return composed(at); };
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const TileId at{id.level, id.col + dx, id.row + dy};
      if ((dx == 0 && dy == 0) || composed(at) == nullptr) continue;
      const ImageryBorder border = imageryBorder(at, -dx, -dy, find);
      renderer_->updateImagery(at, border.x, border.y, border.width, border.height, border.rgba);
    }
  }
}

bool ViewImagery::hasSketch(TileId id) const {
  const std::vector<Part> parts = partsOf(id);
  return std::any_of(parts.begin(), parts.end(),
                     [&](const Part& part) { return stream_.isSketch(part.key); });
}

Status ViewImagery::put(TileId id) {
  if (renderer_ == nullptr) return {};
  TERRANE_TRY(renderer_->uploadImagery(id, borderedImagery(id, [this](TileId at) { return composed(at); })));
  if (composed(id) != nullptr) refreshNeighbours(id);
  return {};
}

Result<bool> ViewImagery::recompose(std::unordered_set<TileId, TileIdHash>& which, bool mayBeSketches,
                                    uint64_t budgetBytes, uint64_t& spent) {
  bool changed = false;
  for (auto at = which.begin(); at != which.end();) {
    if (changed && spent >= budgetBytes) break;
    std::shared_ptr<const ImageryTile> picture;
    const bool isSketch = hasSketch(*at);
    if ((isSketch && !mayBeSketches) || !compose(*at, picture)) {
      ++at;
      continue;
    }
    const TileId id = *at;
    at = which.erase(at);
    pictures_[id] = picture;
    if (isSketch) sketched_.insert(id);
    TERRANE_TRY(put(id));
    spent += TerrainRenderer::imageryBytesPerTile();
    changed = true;
  }
  return changed;
}

Result<bool> ViewImagery::upload(uint64_t budgetBytes, uint64_t frame) {
  uint64_t spent = 0;
  TERRANE_ASSIGN(const bool refined, recompose(sketched_, false, UINT64_MAX, spent));
  spent = 0;
  TERRANE_ASSIGN(const bool refreshed, recompose(stale_, true, budgetBytes, spent));
  bool changed = refined || refreshed;
  // note: by address, so parents come before their children.
  for (const ImageryNeed& need : needs_) {
    if (resident_.has(need.tile) || (!need.tile.isRoot() && !resident_.has(need.tile.parent()))) continue;
    if (changed && spent >= budgetBytes) break;
    std::shared_ptr<const ImageryTile> picture;
    if (!compose(need.tile, picture)) continue;
    while (resident_.isFull()) {
      const auto victim = resident_.victim(frame);
      if (!victim) return changed;
      drop(*victim);
    }
    resident_.add(need.tile, frame);
    pictures_[need.tile] = picture;
    if (hasSketch(need.tile)) sketched_.insert(need.tile);
    TERRANE_TRY(put(need.tile));
    spent += TerrainRenderer::imageryBytesPerTile();
    ++uploaded_;
    changed = true;
  }
  return changed;
}

bool ViewImagery::isSettled() const {
  return sketched_.empty() && std::all_of(needs_.begin(), needs_.end(), [&](const ImageryNeed& need) {
           if (isCurrent(need.tile)) return true;
           std::shared_ptr<const ImageryTile> picture;
           return !compose(need.tile, picture) && stream_.isIdle();
         });
}

}  // namespace terrane
