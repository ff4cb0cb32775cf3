#include "mesh_store.h"

#include <algorithm>

namespace terrane {

namespace {

/// Growth ends here, a gigabyte: then the caller draws too much.
constexpr uint32_t kMostUnits = 1U << 27;
constexpr int kSlotShift = 18;

}  // namespace

MeshStore::MeshStore(gpu::Context& context, const Room& room)
    : context_(context),
      vertices_(GL_ARRAY_BUFFER),
      indices_(GL_ELEMENT_ARRAY_BUFFER),
      vertexUnits_(room.vertices),
      indexUnits_(room.indices) {}

Status MeshStore::makeBuffers() {
  const size_t vertexBytes = size_t{vertexUnits_} * sizeof(PatchVertex);
  const size_t indexBytes = size_t{indexUnits_} * sizeof(uint32_t);
  if (vertices_.sizeBytes() >= vertexBytes && indices_.sizeBytes() >= indexBytes) return {};
  TERRANE_TRY(vertices_.reserve(context_, vertexBytes));
  TERRANE_TRY(indices_.reserve(context_, indexBytes));
  setAttributes(vertexArray_);
  vertexArray_.setIndices(indices_.name());
  glBindVertexArray(0);
  return {};
}

void MeshStore::setAttributes(const gpu::VertexArray& vertexArray) const {
  vertexArray.setAttribute(
      vertices_.name(),
      {.location = 0, .components = 1, .type = GL_UNSIGNED_INT, .strideBytes = sizeof(PatchVertex)});
  vertexArray.setAttribute(vertices_.name(), {.location = 1,
                                              .components = 2,
                                              .type = GL_FLOAT,
                                              .offsetBytes = offsetof(PatchVertex, heightMeters),
                                              .strideBytes = sizeof(PatchVertex)});
}

void MeshStore::add(TileId id, std::shared_ptr<const MeshLevel> meshes) {
  Level& kept = meshes_[id][meshes->level];
  if (kept.meshes != nullptr) releaseAll(id, *kept.meshes);
  kept.entries.assign(meshes->patches.size(), nullptr);
  kept.meshes = std::move(meshes);
}

/// Patches of a tile and level mostly follow each other.
MeshStore::Level* MeshStore::find(TileId id, int level) {
  if (last_ != nullptr && lastTile_ == id && lastLevel_ == level) return last_;
  const auto tile = meshes_.find(id);
  if (tile == meshes_.end()) return nullptr;
  const auto at = tile->second.find(level);
  if (at == tile->second.end()) return nullptr;
  last_ = &at->second;
  lastTile_ = id;
  lastLevel_ = level;
  return last_;
}

void MeshStore::forget(const Key& key) {
  const auto at = entries_.find(key);
  if (at == entries_.end()) return;
  release(at->second);
  entries_.erase(at);
  if (Level* level = find(key.tile, key.level)) level->entries[static_cast<size_t>(key.index)] = nullptr;
}

bool MeshStore::has(TileId id, int level) const {
  const auto found = meshes_.find(id);
  return found != meshes_.end() && found->second.count(level) != 0;
}

void MeshStore::drop(TileId id) {
  const auto found = meshes_.find(id);
  if (found == meshes_.end()) return;
  for (const auto& [level, held] : found->second) releaseAll(id, *held.meshes);
  meshes_.erase(found);
  last_ = nullptr;
}

void MeshStore::drop(TileId id, int level) {
  const auto tile = meshes_.find(id);
  if (tile == meshes_.end()) return;
  const auto at = tile->second.find(level);
  if (at == tile->second.end()) return;
  releaseAll(id, *at->second.meshes);
  tile->second.erase(at);
  if (tile->second.empty()) meshes_.erase(tile);
  last_ = nullptr;
}

void MeshStore::releaseAll(TileId id, const MeshLevel& meshes) {
  forgetArriving();
  for (int index = 0; index < static_cast<int>(meshes.patches.size()); ++index) {
    forget({id, meshes.level, index});
  }
}

void MeshStore::release(const Entry& entry) {
  if (entry.slot >= 0) slots_.giveBack(entry.slot);
}

void MeshStore::beginFrame() {
  forgetArriving();
  ++frame_;
}

/// What a frame that failed did not upload was never there.
void MeshStore::forgetArriving() {
  for (const auto& [key, entry] : arriving_) forget(key);
  arriving_.clear();
  arrivingVertices_ = arrivingIndices_ = 0;
}

void MeshStore::arrive(const Key& key, Entry& entry) {
  arriving_.emplace_back(key, &entry);
  arrivingVertices_ += entry.patch().vertexCount;
  arrivingIndices_ += entry.patch().indexCount;
}

/// Is there room for what arrives, side by side, before the places of the oldest that is written?
bool MeshStore::hasRoom() const {
  const auto fits = [](uint64_t next, uint64_t count, uint64_t units, uint64_t begin) {
    // note: what does not fit before the buffer's end begins anew.
    const uint64_t at = next % units + count > units ? next + units - next % units : next;
    return count <= units && at + count <= begin + units;
  };
  if (written_.empty()) return arrivingVertices_ <= vertexUnits_ && arrivingIndices_ <= indexUnits_;
  const Written& oldest = written_.front();
  return fits(nextVertex_, arrivingVertices_, vertexUnits_, oldest.firstVertex) &&
         fits(nextIndex_, arrivingIndices_, indexUnits_, oldest.firstIndex);
}

/// Frees the places of the oldest; if it is drawn in this frame it arrives anew.
bool MeshStore::freeOldest() {
  if (written_.empty()) return false;
  const Written oldest = written_.front();
  written_.pop_front();
  const auto at = entries_.find(oldest.key);
  if (at == entries_.end() || at->second.serial != oldest.serial) return true;
  if (at->second.frame == frame_) {
    arrive(at->first, at->second);
  } else {
    forget(oldest.key);
  }
  return true;
}

Result<const MeshStore::Entry*> MeshStore::place(TileId id, int level, int index) {
  Level* const held = find(id, level);
  if (held == nullptr)
    return makeError("the cut draws a mesh of tile {}, level {}, which was not made", toString(id), level);
  Entry*& kept = held->entries[static_cast<size_t>(index)];
  if (kept != nullptr) {
    kept->frame = frame_;
    return kept;
  }
  const Key key{id, level, index};
  Entry entry;
  entry.meshes = held->meshes;
  entry.index = index;
  entry.frame = frame_;
  kept = &entries_.emplace(key, std::move(entry)).first->second;
  arrive(key, *kept);
  return kept;
}

Status MeshStore::upload() {
  if (arriving_.empty()) return {};
  // Slots first: those that were written longest ago give way.
  while (entries_.size() > kMostSlots)
    if (!freeOldest())
      return makeError("more than {} meshes are drawn at once; draw with a larger tau", kMostSlots);
  for (const auto& [key, entry] : arriving_)
    if (entry->slot < 0) entry->slot = slots_.take();

  // Then places. Where most would be written again and again, larger buffers are filled anew.
  const auto isCramped = [](uint64_t count, uint32_t units) {
    return 2 * count > units && units < kMostUnits;
  };
  for (;;) {
    const bool grows = isCramped(arrivingVertices_, vertexUnits_) || isCramped(arrivingIndices_, indexUnits_);
    if (!grows && hasRoom()) break;
    if (freeOldest()) continue;
    if (!grows)
      return makeError("no room for meshes on the GPU: {} MB are drawn at once; draw with a larger tau",
                       gpuBytes() >> 20);
    if (isCramped(arrivingVertices_, vertexUnits_)) vertexUnits_ *= 2;
    if (isCramped(arrivingIndices_, indexUnits_)) indexUnits_ *= 2;
    nextVertex_ = nextIndex_ = 0;
  }
  TERRANE_TRY(makeBuffers());
  const auto begin = [](uint64_t next, uint64_t count, uint64_t units) {
    return next % units + count > units ? next + units - next % units : next;
  };
  uint64_t vertex = begin(nextVertex_, arrivingVertices_, vertexUnits_);
  uint64_t index = begin(nextIndex_, arrivingIndices_, indexUnits_);
  const size_t vertexBytes = static_cast<size_t>(vertex % vertexUnits_) * sizeof(PatchVertex);
  const size_t indexBytes = static_cast<size_t>(index % indexUnits_) * sizeof(uint32_t);

  newVertices_.clear();
  newIndices_.clear();
  for (const auto& [key, entry] : arriving_) {
    const MeshLevel& meshes = *entry->meshes;
    const MeshLevel::Patch& patch = entry->patch();
    entry->firstVertex = static_cast<uint32_t>(vertex % vertexUnits_);
    entry->firstIndex = static_cast<uint32_t>(index % indexUnits_);
    entry->serial = ++lastSerial_;
    written_.push_back({key, entry->serial, vertex, index});
    vertex += patch.vertexCount;
    index += patch.indexCount;
    // Vertices learn their slot, indices count from the buffer's beginning.
    const PatchVertex* vertices = meshes.vertices.data() + patch.firstVertex;
    newVertices_.insert(newVertices_.end(), vertices, vertices + patch.vertexCount);
    for (size_t i = newVertices_.size() - patch.vertexCount; i < newVertices_.size(); ++i)
      newVertices_[i].place |= static_cast<uint32_t>(entry->slot) << kSlotShift;
    for (uint32_t i = 0; i < patch.indexCount; ++i)
      newIndices_.push_back(entry->firstVertex + meshes.indices[patch.firstIndex + i]);
  }
  nextVertex_ = vertex;
  nextIndex_ = index;
  vertices_.write(vertexBytes, newVertices_.data(), newVertices_.size() * sizeof(PatchVertex));
  indices_.write(indexBytes, newIndices_.data(), newIndices_.size() * sizeof(uint32_t));
  arriving_.clear();
  arrivingVertices_ = arrivingIndices_ = 0;
  return {};
}

}  // namespace terrane
