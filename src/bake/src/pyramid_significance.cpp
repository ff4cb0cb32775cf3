#include <array>

#include "pyramid_steps.h"
#include "significance.h"

namespace terrane {

namespace {

struct Scratch {
  std::array<std::array<uint8_t, kSampleBitsBytes>, 9> needs;
  std::vector<uint8_t> significant = std::vector<uint8_t>(static_cast<size_t>(kTileSampleCount));
  std::vector<float> heights = std::vector<float>(static_cast<size_t>(kTileSampleCount));
  std::vector<SampleState> states = std::vector<SampleState>(static_cast<size_t>(kTileSampleCount));
};

/// The needs in and around a tile.
Status readNeeds(const Pyramid& pyramid, const NeedStore& store, TileId id, Scratch& scratch,
                 NeedsAround& around) {
  const auto& tiles = pyramid.levels[static_cast<size_t>(id.level)];
  for (size_t i = 0; i < around.size(); ++i) {
    around[i] = nullptr;
    const TileId neighbour{id.level, id.col + static_cast<int>(i % 3) - 1,
                           id.row + static_cast<int>(i / 3) - 1};
    const int index = neighbour.valid() ? pyramid.find(neighbour) : -1;
    if (index < 0 || !tiles[static_cast<size_t>(index)].hasNeeds) continue;
    const auto block = static_cast<uint64_t>(tiles[static_cast<size_t>(index)].heights);
    TERRANE_TRY(store.bits.readValues<uint8_t>(block, scratch.needs[i]));
    around[i] = scratch.needs[i].data();
  }
  return {};
}

}  // namespace

NeedStore::NeedStore(double maxError, uint64_t memoryBytes, const std::string& scratchFolder)
    : maxErrorMeters(maxError), bits(kSampleBitsBytes, memoryBytes, scratchFolder) {}

Status interpolateFinestTiles(Pyramid& pyramid, const NeedStore& needs, const Workers& workers) {
  auto& tiles = pyramid.levels.back();
  std::vector<Scratch> scratches(static_cast<size_t>(workers.count()));
  return workers.forEach(static_cast<int64_t>(tiles.size()), [&](int worker, int64_t i) -> Status {
    Scratch& scratch = scratches[static_cast<size_t>(worker)];
    PyramidTile& tile = tiles[static_cast<size_t>(i)];
    // note: a tile without needs has no height, or it would need its neighbours' samples on its border.
    if (!tile.hasNeeds) return {};
    NeedsAround around{};
    TERRANE_TRY(readNeeds(pyramid, needs, tile.id, scratch, around));
    findSignificant(around, scratch.significant);
    TERRANE_TRY(pyramid.readHeights(tile, scratch.heights));
    if (interpolateInsignificant(scratch.significant, scratch.heights, scratch.states)) return {};
    tile.rough = isRough(scratch.heights);
    TERRANE_TRY(pyramid.writeHeights(tile, scratch.heights));
    return pyramid.writeStates(tile, scratch.states);
  });
}

}  // namespace terrane
