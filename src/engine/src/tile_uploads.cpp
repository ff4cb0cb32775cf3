#include "tile_uploads.h"

#include <algorithm>
#include <utility>

#include "terrane/engine/tile_orders.h"

namespace terrane {
namespace {

/// Prepared tiles that nobody has wanted for so many frames are forgotten.
constexpr uint64_t kPatienceFrames = 120;
/// Meshes that so many selections have not looked at may be forgotten: more than there are from one look
/// ahead or around to the next.
constexpr uint64_t kMeshPatienceTurns = 120;

}  // namespace

TileUploads::TileUploads(const TileStream& stream, Workers& workers, TerrainRenderer* renderer,
                         size_t capacity)
    : stream_(stream),
      workers_(workers),
      renderer_(renderer),
      resident_(std::max<size_t>(capacity, 1)),
      meshes_(stream.manifest().frame, stream.manifest().scale),
      finished_(std::make_shared<Finished>()) {}

const Tile* TileUploads::find(TileId id) const {
  const auto at = tiles_.find(id);
  return at == tiles_.end() ? nullptr : at->second.get();
}

std::vector<TileId> TileUploads::tiles() const {
  std::vector<TileId> out;
  for (const auto& [id, tile] : tiles_) out.push_back(id);
  return out;
}

void TileUploads::arrived(const std::vector<TileKey>& news, uint64_t frame) {
  for (const TileKey& key : news)
    if (key.isElevation()) arrivedIn_[key.tile] = frame;
}

void TileUploads::takePrepared() {
  decltype(finished_->made) made;
  {
    const std::lock_guard lock(finished_->mutex);
    made = std::exchange(finished_->made, {});
  }
  for (auto& [tile, prepared] : made)
    for (auto& [id, waiting] : prepared_)
      if (waiting.tile == tile) waiting.made = std::move(prepared);
}

bool TileUploads::isStale(TileId id) const {
  const auto at = tiles_.find(id);
  if (at == tiles_.end()) return false;
  const std::shared_ptr<const Tile> tile = stream_.elevation(id);
  if (tile == nullptr || tile == at->second) return false;
  return (id.isRoot() && rootIsSketch_) || tile->samples.layerCount > at->second->samples.layerCount;
}

/// Can the tile be uploaded now? If it is decoded and not prepared, that is begun.
bool TileUploads::isPrepared(TileId id, uint64_t frame) {
  auto at = prepared_.find(id);
  std::shared_ptr<const Tile> tile = stream_.elevation(id);
  if (at != prepared_.end() && tile != nullptr && at->second.tile != tile) {
    prepared_.erase(at);
    at = prepared_.end();
  }
  if (at == prepared_.end()) {
    if (tile == nullptr) return false;
    at = prepared_.emplace(id, Prepared{tile, nullptr, frame}).first;
    if (renderer_ == nullptr) return true;
    // note: before the root there is nothing to draw.
    if (id.isRoot()) {
      at->second.made = prepareTile(tile->samples);
      return true;
    }
    workers_.order(PrepareTile{tile}, [finished = finished_, tile](std::shared_ptr<const PreparedTile> made) {
      const std::lock_guard lock(finished->mutex);
      finished->made.emplace_back(tile, std::move(made));
    });
    takePrepared();
  }
  at->second.frame = frame;
  return renderer_ == nullptr || at->second.made != nullptr;
}

bool TileUploads::makeRoom(uint64_t frame) {
  while (resident_.isFull()) {
    const auto victim = resident_.victim(frame);
    if (!victim) return false;
    resident_.remove(*victim);
    ++changes_;
    tiles_.erase(*victim);
    meshes_.drop(*victim);
    uploadedIn_.erase(*victim);
    if (renderer_ != nullptr) renderer_->dropTile(*victim);
  }
  return true;
}

Result<int> TileUploads::upload(const std::vector<TileId>& order, uint64_t budgetBytes, uint64_t frame,
                                uint64_t keepSince) {
  takePrepared();
  shortOfRoom_ = false;
  const uint64_t bytesEach =
      TerrainRenderer::geometryBytesPerTile() + TerrainRenderer::lightingBytesPerTile();
  int count = 0;
  if (isStale(TileId{}) && isPrepared(TileId{}, frame)) {
    TERRANE_TRY(replace(TileId{}));
    ++count;
  }
  // note: what was decoded from the whole root does not fit to its sketch.
  const bool onlyRoot = rootIsSketch_ && isStale(TileId{});
  for (const TileId id : order) {
    const bool isHere = resident_.has(id);
    if ((isHere && !isStale(id)) || (onlyRoot && !id.isRoot()) || !isPrepared(id, frame)) continue;
    if (!id.isRoot() && !resident_.has(id.parent())) continue;
    if (count > 0 && static_cast<uint64_t>(count + 1) * bytesEach > budgetBytes) break;
    if (isHere) {
      TERRANE_TRY(replace(id));
      ++count;
      continue;
    }
    if (!makeRoom(keepSince)) {
      shortOfRoom_ = true;
      break;
    }
    const auto prepared = prepared_.find(id);
    if (renderer_ != nullptr)
      TERRANE_TRY(renderer_->uploadTile(id, *prepared->second.tile, prepared->second.made));
    tiles_[id] = std::move(prepared->second.tile);
    prepared_.erase(prepared);
    if (id.isRoot()) rootIsSketch_ = stream_.isSketch(TileKey::elevation(id));
    resident_.add(id, frame);
    uploadedIn_[id] = frame;
    ++uploaded_;
    ++changes_;
    ++count;

    // How long could it have been drawn from, had it been here at once?
    uint64_t since = frame;
    if (const auto at = arrivedIn_.find(id); at != arrivedIn_.end()) {
      since = at->second;
      arrivedIn_.erase(at);
      if (!id.isRoot())
        if (const auto parent = uploadedIn_.find(id.parent()); parent != uploadedIn_.end())
          since = std::max(since, parent->second);
      mostFramesUntilUsed_ = std::max(mostFramesUntilUsed_, static_cast<int>(frame - since));
    }
  }
  for (auto at = prepared_.begin(); at != prepared_.end();)
    at = at->second.frame + kPatienceFrames < frame ? prepared_.erase(at) : std::next(at);
  // note: what was not asked for when it came (prefetched) did not wait.
  std::unordered_map<TileId, uint64_t, TileIdHash> waiting;
  for (const TileId id : order)
    if (const auto at = arrivedIn_.find(id); at != arrivedIn_.end()) waiting.insert(*at);
  arrivedIn_ = std::move(waiting);
  return count;
}

Status TileUploads::replace(TileId id) {
  const auto prepared = prepared_.find(id);
  if (renderer_ != nullptr)
    TERRANE_TRY(renderer_->uploadTile(id, *prepared->second.tile, prepared->second.made));
  tiles_[id] = std::move(prepared->second.tile);
  prepared_.erase(prepared);
  ++uploaded_;
  if (!id.isRoot() || !rootIsSketch_) return {};
  // What was made of a sketch is not the root's. note: layers move nothing, so meshes stay when more come.
  rootIsSketch_ = stream_.isSketch(TileKey::elevation(id));
  ++roots_;
  const bool hadMeshes = meshes_.find(id, 0) != nullptr;
  for (int level = 0; renderer_ != nullptr && level <= kDeepestVertexLevel; ++level)
    if (meshes_.get(id, level) != nullptr) renderer_->dropMeshes(id, level);
  meshes_.drop(id);
  if (hadMeshes) makeRootMeshes();
  return {};
}

void TileUploads::wishMeshes(const std::vector<MeshWish>& wishes) {
  for (const MeshWish& wish : wishes) {
    if (std::find(meshesUnderWay_.begin(), meshesUnderWay_.end(), wish) != meshesUnderWay_.end()) continue;
    const auto tile = tiles_.find(wish.tile);
    if (tile == tiles_.end()) continue;
    meshesUnderWay_.push_back(wish);
    workers_.order(MakeMeshes{meshes_.orderFor(wish), tile->second},
                   [finished = finished_, wish, roots = roots_](MakeMeshes::Answer levels) {
                     const std::lock_guard lock(finished->mutex);
                     finished->meshes.push_back({wish, roots, std::move(levels)});
                   });
  }
}

bool TileUploads::takeMeshes() {
  std::vector<MadeMeshes> made;
  {
    const std::lock_guard lock(finished_->mutex);
    made = std::exchange(finished_->meshes, {});
  }
  bool any = false;
  for (MadeMeshes& each : made) {
    meshesUnderWay_.erase(std::find(meshesUnderWay_.begin(), meshesUnderWay_.end(), each.wish));
    // note: the tile may have gone in the meantime, and a root may have been a sketch.
    if (tiles_.count(each.wish.tile) == 0 || (each.wish.tile.isRoot() && each.roots != roots_)) continue;
    addMeshes(each.wish.tile, std::move(each.levels));
    any = true;
  }
  return any;
}

void TileUploads::addMeshes(TileId id, std::vector<std::shared_ptr<const MeshLevel>> made) {
  for (auto& meshes : made) {
    if (renderer_ != nullptr) renderer_->addMeshes(id, meshes);
    meshes_.add(id, std::move(meshes));
  }
}

void TileUploads::keepMeshesWithin(uint64_t bytes) {
  if (meshes_.sizeBytes() <= bytes) return;
  // Rather more at once than every time.
  for (const MeshWish& unused : meshes_.keepWithin(bytes / 8 * 7, kMeshPatienceTurns))
    if (renderer_ != nullptr) renderer_->dropMeshes(unused.tile, unused.level);
}

void TileUploads::makeRootMeshes() {
  const TileId root;
  const auto tile = tiles_.find(root);
  if (tile == tiles_.end() || meshes_.find(root, 0) != nullptr) return;
  const TileMeshes::Order order = meshes_.orderFor({root, 0});
  // note: in a world of few levels even the root's meshes may want more layers than the first.
  if (order.meshScale.layerOf(0) >= tile->second->samples.layerCount) return;
  addMeshes(root, TileMeshes::make(order, *tile->second));
}

void TileUploads::need(const Cut& cut, uint64_t frame) {
  // Patches of a tile mostly follow each other.
  TileId last{-1, 0, 0}, lastShading{-1, 0, 0};
  for (const std::vector<Patch>* patches : {&cut.patches, &cut.hidden}) {
    for (const Patch& patch : *patches) {
      if (!(patch.tile == last)) resident_.need(patch.tile, frame);
      if (!(patch.shadingTile == lastShading)) resident_.need(patch.shadingTile, frame);
      last = patch.tile;
      lastShading = patch.shadingTile;
    }
  }
  // A split needs up to four tiles that meet; those that are here wait for the others.
  for (const TileWish& wish : cut.wishes)
    for (int row = -1; row <= 1; ++row)
      for (int col = -1; col <= 1; ++col) {
        const TileId beside{wish.tile.level, wish.tile.col + col, wish.tile.row + row};
        if (beside.valid()) resident_.need(beside, frame);
      }
}

bool TileUploads::isPending(const std::vector<TileId>& order) const {
  return isStale(TileId{}) || std::any_of(order.begin(), order.end(), [&](TileId id) {
           return resident_.has(id) ? isStale(id) : stream_.elevation(id) != nullptr;
         });
}

}  // namespace terrane
