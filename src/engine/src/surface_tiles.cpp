#include <list>
#include <mutex>
#include <unordered_map>

#include "terrane/codec/all_layers.h"
#include "terrane/engine/surface.h"

namespace terrane {
namespace {

uint64_t bytesOf(const Tile& tile) {
  return sizeof(Tile) + tile.samples.heights.capacity() * sizeof(float) +
         tile.samples.states.capacity() * sizeof(SampleState) + tile.samples.coverage.bits.capacity() +
         tile.samples.layers.capacity() + tile.nodes.error.capacity() + tile.nodes.largeError.capacity() +
         (tile.nodes.low.capacity() + tile.nodes.high.capacity()) * sizeof(uint16_t);
}

}  // namespace

struct SurfaceTiles::State {
  struct Entry {
    TileId id;
    std::shared_ptr<const Tile> tile;
    uint64_t bytes = 0;
  };
  explicit State(uint64_t bytes) : budget(bytes) {}
  const uint64_t budget;
  mutable std::mutex mutex;
  std::list<Entry> entries;  ///< last used first
  std::unordered_map<TileId, std::list<Entry>::iterator, TileIdHash> places;
  Statistics statistics;
};

SurfaceTiles::SurfaceTiles(const Dataset& dataset, uint64_t budgetBytes)
    : dataset_(dataset), state_(std::make_unique<State>(budgetBytes)) {}
SurfaceTiles::~SurfaceTiles() = default;

SurfaceTiles::Statistics SurfaceTiles::statistics() const {
  const std::lock_guard lock(state_->mutex);
  return state_->statistics;
}

Result<std::shared_ptr<const Tile>> SurfaceTiles::get(TileId id, const Tile* parent) {
  State& state = *state_;
  {
    const std::lock_guard lock(state.mutex);
    if (const auto at = state.places.find(id); at != state.places.end()) {
      ++state.statistics.hits;
      state.entries.splice(state.entries.begin(), state.entries, at->second);
      return at->second->tile;
    }
    ++state.statistics.misses;
  }

  // Read and decode without the lock.
  TERRANE_ASSIGN(const auto payloads, dataset_.readAllLayers(id));
  if (!payloads)
    return makeError("{}: tile {} is missing from the elevation archive; build the dataset again",
                     dataset_.directory(), toString(id));
  auto decoded = decodeAllLayers(*payloads, parent != nullptr ? &parent->samples : nullptr,
                                 id.isRoot() ? 0 : id.quadrant(), dataset_.manifest().scale);
  if (!decoded.ok())
    return makeError("{}: tile {}: {}", dataset_.directory(), toString(id), decoded.error().message);
  auto tile = std::make_shared<const Tile>(std::move(decoded).value());

  const std::lock_guard lock(state.mutex);
  if (const auto at = state.places.find(id); at != state.places.end()) return at->second->tile;
  const uint64_t bytes = bytesOf(*tile);
  state.entries.push_front({id, tile, bytes});
  state.places[id] = state.entries.begin();
  state.statistics.bytes += bytes;
  while (state.statistics.bytes > state.budget && state.entries.size() > 1) {
    state.statistics.bytes -= state.entries.back().bytes;
    state.places.erase(state.entries.back().id);
    state.entries.pop_back();
  }
  return tile;
}

}  // namespace terrane
