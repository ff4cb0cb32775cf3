#include <algorithm>
#include <array>

#include "pyramid_steps.h"
#include "significance.h"

namespace terrane {

namespace {

struct WorkerScratch {
  std::array<std::array<uint8_t, kSampleBitsBytes>, 9> needs;
  std::vector<uint8_t> significant = std::vector<uint8_t>(static_cast<size_t>(kTileSampleCount));
  std::vector<float> heights = std::vector<float>(static_cast<size_t>(kTileSampleCount));
  std::vector<SampleState> states = std::vector<SampleState>(static_cast<size_t>(kTileSampleCount));
};

/// The needs in and around a tile.
Status readNeeds(const Pyramid& pyramid, const NeedStore& store, TileId id, WorkerScratch& scratch,
                 NeedsAround& around) {
  const auto& tiles = pyramid.levels[static_cast<size_t>(id.level)];
  for (size_t i = 0; i < around.size(); ++i) {
    around[i] = nullptr;
    const TileId neighbour{id.level, id.col + static_cast<int>(i % 3) - 1,
                           id.row + static_cast<int>(i / 3) - 1};
    const int index = neighbour.valid() ? pyramid.find(neighbour) : -1;
    if (index < 0 || !tiles[static_cast<size_t>(index)].hasNeeds) continue;
    const auto block = static_cast<uint64_t>(tiles[static_cast<size_t>(index)].block);
    TERRANE_TRY(store.bits.readValues<uint8_t>(block, scratch.needs[i]));
    around[i] = scratch.needs[i].data();
  }
  return {};
}

/// What became of a tile.
struct Outcome {
  bool rough = false;
  bool hasStates = false;
};

}  // namespace

NeedStore::NeedStore(double maxError, const Scratch& scratch)
    : maxErrorMeters(maxError), bits(kSampleBitsBytes, scratch, "needs") {}

Status interpolateFinestTiles(Pyramid& pyramid, const NeedStore& needs, Jobs& jobs) {
  std::vector<WorkerScratch> scratches(static_cast<size_t>(jobs.workers().count()));
  // note: a tile without needs has no height, or it would need its neighbours' samples on its border.
  std::vector<PyramidTile*> tiles;
  for (PyramidTile& tile : pyramid.levels.back()) {
    if (tile.hasNeeds) tiles.push_back(&tile);
  }
  const auto outcomes =
      jobs.run<Outcome>("interpolating", static_cast<int64_t>(tiles.size()), nullptr,
                        [&](int worker, int64_t i) -> Result<Outcome> {
                          WorkerScratch& scratch = scratches[static_cast<size_t>(worker)];
                          const PyramidTile& tile = *tiles[static_cast<size_t>(i)];
                          NeedsAround around{};
                          TERRANE_TRY(readNeeds(pyramid, needs, tile.id, scratch, around));
                          findSignificant(around, scratch.significant);
                          TERRANE_TRY(pyramid.readRawHeights(tile, scratch.heights));
                          if (interpolateInsignificant(scratch.significant, scratch.heights, scratch.states))
                            return Outcome{tile.rough, false};
                          TERRANE_TRY(pyramid.writeRawHeights(tile, scratch.heights));
                          TERRANE_TRY(pyramid.writeStates(tile, scratch.states));
                          return Outcome{isRough(scratch.heights), true};
                        });
  if (!outcomes.ok()) return outcomes.error();
  for (size_t i = 0; i < tiles.size(); ++i) {
    tiles[i]->rough = (*outcomes)[i].rough;
    tiles[i]->hasStates = (*outcomes)[i].hasStates;
  }
  return {};
}

}  // namespace terrane
