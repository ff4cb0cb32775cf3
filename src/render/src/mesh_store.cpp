#include "mesh_store.h"

#include <algorithm>

namespace terrane {

namespace {

/// Room at first, 28 MB: what a frame draws several times over, so that what comes back into view is still
/// there. Smallest pieces: a patch of two triangles is not worth less.
constexpr uint32_t kFirstVertices = 1U << 20;
constexpr uint32_t kFirstIndices = 1U << 22;
constexpr uint32_t kSmallestVertices = 16;
constexpr uint32_t kSmallestIndices = 32;
/// Growth ends here, a gigabyte: then the caller draws too much.
constexpr uint32_t kMostUnits = 1U << 27;
constexpr int kSlotShift = 18;

}  // namespace

MeshStore::MeshStore(gpu::Context& context)
    : context_(context),
      vertexPlaces_(kFirstVertices, kSmallestVertices),
      indexPlaces_(kFirstIndices, kSmallestIndices),
      vertices_(GL_ARRAY_BUFFER),
      indices_(GL_ELEMENT_ARRAY_BUFFER) {}

Status MeshStore::makeBuffers() {
  const size_t vertexBytes = size_t{vertexPlaces_.units()} * sizeof(PatchVertex);
  const size_t indexBytes = size_t{indexPlaces_.units()} * sizeof(uint32_t);
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
  std::shared_ptr<const MeshLevel>& kept = meshes_[id][meshes->level];
  if (kept != nullptr) releaseAll(id, *kept);
  kept = std::move(meshes);
}

bool MeshStore::has(TileId id, int level) const {
  const auto found = meshes_.find(id);
  return found != meshes_.end() && found->second.count(level) != 0;
}

void MeshStore::drop(TileId id) {
  const auto found = meshes_.find(id);
  if (found == meshes_.end()) return;
  for (const auto& [level, meshes] : found->second) releaseAll(id, *meshes);
  meshes_.erase(found);
}

void MeshStore::releaseAll(TileId id, const MeshLevel& meshes) {
  for (int index = 0; index < static_cast<int>(meshes.patches.size()); ++index) {
    const auto at = entries_.find({id, meshes.level, index});
    if (at == entries_.end()) continue;
    release(at->second);
    entries_.erase(at);
  }
}

void MeshStore::release(const Entry& entry) {
  slots_.giveBack(entry.slot);
  vertexPlaces_.giveBack(entry.firstVertex);
  indexPlaces_.giveBack(entry.firstIndex);
}

bool MeshStore::dropOldest() {
  // All of the oldest quarter of the frames go: looking for each would cost as much.
  uint64_t oldest = frame_;
  for (const auto& [key, entry] : entries_) oldest = std::min(oldest, entry.frame);
  if (oldest == frame_) return false;
  const uint64_t last = oldest + (frame_ - 1 - oldest) / 4;
  for (auto at = entries_.begin(); at != entries_.end();) {
    if (at->second.frame > last) {
      ++at;
      continue;
    }
    release(at->second);
    at = entries_.erase(at);
  }
  return true;
}

Result<uint32_t> MeshStore::takeRoom(BuddyAllocator& places, uint32_t units) {
  for (;;) {
    if (const auto first = places.take(units)) return *first;
    if (dropOldest()) continue;
    if (places.units() >= kMostUnits)
      return makeError("no room for meshes on the GPU: {} MB are drawn at once; draw with a larger tau",
                       gpuBytes() >> 20);
    places.grow();
  }
}

Result<const MeshStore::Entry*> MeshStore::place(TileId id, int level, int index) {
  const Key key{id, level, index};
  if (const auto at = entries_.find(key); at != entries_.end()) {
    at->second.frame = frame_;
    return &at->second;
  }
  const auto tile = meshes_.find(id);
  if (tile == meshes_.end() || tile->second.count(level) == 0)
    return makeError("the cut draws a mesh of tile {}, level {}, which was not made", toString(id), level);
  Entry entry;
  entry.meshes = tile->second.at(level);
  entry.index = index;
  entry.frame = frame_;
  const MeshLevel& meshes = *entry.meshes;
  const MeshLevel::Patch& patch = entry.patch();

  while (entries_.size() >= kMostSlots)
    if (!dropOldest())
      return makeError("more than {} meshes are drawn at once; draw with a larger tau", kMostSlots);
  TERRANE_ASSIGN(entry.firstVertex, takeRoom(vertexPlaces_, patch.vertexCount));
  auto room = takeRoom(indexPlaces_, patch.indexCount);
  if (!room.ok()) {
    vertexPlaces_.giveBack(entry.firstVertex);
    return room.error();
  }
  entry.firstIndex = *room;
  entry.slot = slots_.take();
  if (const Status made = makeBuffers(); !made.ok()) {
    release(entry);
    return made.error();
  }

  // Vertices learn their slot, indices count from the buffer's beginning.
  const PatchVertex* vertices = meshes.vertices.data() + patch.firstVertex;
  newVertices_.insert(newVertices_.end(), vertices, vertices + patch.vertexCount);
  for (size_t i = newVertices_.size() - patch.vertexCount; i < newVertices_.size(); ++i)
    newVertices_[i].place |= static_cast<uint32_t>(entry.slot) << kSlotShift;
  for (uint32_t i = 0; i < patch.indexCount; ++i)
    newIndices_.push_back(entry.firstVertex + meshes.indices[patch.firstIndex + i]);
  vertexPieces_.push_back(
      {size_t{entry.firstVertex} * sizeof(PatchVertex), size_t{patch.vertexCount} * sizeof(PatchVertex)});
  indexPieces_.push_back(
      {size_t{entry.firstIndex} * sizeof(uint32_t), size_t{patch.indexCount} * sizeof(uint32_t)});
  return &entries_.emplace(key, std::move(entry)).first->second;
}

void MeshStore::upload() {
  vertices_.write(vertexPieces_, newVertices_.data());
  indices_.write(indexPieces_, newIndices_.data());
  newVertices_.clear();
  newIndices_.clear();
  vertexPieces_.clear();
  indexPieces_.clear();
}

}  // namespace terrane
