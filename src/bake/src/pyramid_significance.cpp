#include <algorithm>
#include <array>
#include <utility>

#include "pyramid_steps.h"
#include "significance.h"

namespace terrane {

namespace {

struct SignificanceScratch {
  std::array<std::array<uint8_t, kSampleBitsBytes>, 9> needs;
  std::vector<uint8_t> significant = std::vector<uint8_t>(static_cast<size_t>(kTileSampleCount));
  std::vector<uint8_t> layers = std::vector<uint8_t>(static_cast<size_t>(kTileSampleCount));
  std::vector<float> heights = std::vector<float>(static_cast<size_t>(kTileSampleCount));
  std::vector<SampleState> states = std::vector<SampleState>(static_cast<size_t>(kTileSampleCount));
};

/// A layer's needs in and around a tile.
Status readNeeds(const Pyramid& pyramid, const NeedStore& store, int layer, TileId id,
                 SignificanceScratch& scratch, NeedsAround& around) {
  const auto& tiles = pyramid.levels[static_cast<size_t>(id.level)];
  for (size_t i = 0; i < around.size(); ++i) {
    around[i] = nullptr;
    const TileId neighbour{id.level, id.col + static_cast<int>(i % 3) - 1,
                           id.row + static_cast<int>(i / 3) - 1};
    const int index = neighbour.valid() ? pyramid.find(neighbour) : -1;
    if (index < 0 || !tiles[static_cast<size_t>(index)].hasNeeds) continue;
    const auto block = static_cast<uint64_t>(tiles[static_cast<size_t>(index)].block);
    TERRANE_TRY(store.bits.read(block, std::as_writable_bytes(std::span(scratch.needs[i])),
                                static_cast<size_t>(layer) * kSampleBitsBytes));
    around[i] = scratch.needs[i].data();
  }
  return {};
}

/// What became of a tile.
struct SignificanceOutcome {
  bool rough = false;
  bool hasStates = false;
  bool hasLayers = false;
};

/// What the dataset's own bound makes significant, in scratch.significant, and the first layer in which each
/// of these samples is, in scratch.layers.
Status findLayers(const Pyramid& pyramid, const NeedStore& needs, TileId id, SignificanceScratch& scratch) {
  const auto last = static_cast<uint8_t>(needs.layerCount() - 1);
  std::fill(scratch.layers.begin(), scratch.layers.end(), last);
  for (int layer = 0; layer <= last; ++layer) {
    NeedsAround around{};
    TERRANE_TRY(readNeeds(pyramid, needs, layer, id, scratch, around));
    findSignificant(around, scratch.significant);
    for (size_t i = 0; layer < last && i < scratch.layers.size(); ++i) {
      if (scratch.significant[i] != 0 && scratch.layers[i] == last)
        scratch.layers[i] = static_cast<uint8_t>(layer);
    }
  }
  return {};
}

/// Leaves the layers of Coded samples alone, of which there is then one at least beyond the first, or not.
bool keepLayersOfCoded(SignificanceScratch& scratch) {
  bool any = false;
  for (size_t i = 0; i < scratch.layers.size(); ++i) {
    if (scratch.states[i] != SampleState::Coded) scratch.layers[i] = 0;
    any |= scratch.layers[i] != 0;
  }
  return any;
}

}  // namespace

NeedStore::NeedStore(std::vector<double> bounds, const Scratch& scratch)
    : boundsMeters(std::move(bounds)), bits(boundsMeters.size() * kSampleBitsBytes, scratch, "needs") {}

Status interpolateFinestTiles(Pyramid& pyramid, const NeedStore& needs, Jobs& jobs) {
  std::vector<SignificanceScratch> scratches(static_cast<size_t>(jobs.workers().count()));
  // note: a tile without needs has no height, or it would need its neighbours' samples on its border.
  std::vector<PyramidTile*> tiles;
  for (PyramidTile& tile : pyramid.levels.back()) {
    if (tile.hasNeeds) tiles.push_back(&tile);
  }
  const auto outcomes = jobs.run<SignificanceOutcome>(
      "interpolating", static_cast<int64_t>(tiles.size()), nullptr,
      [&](int worker, int64_t i) -> Result<SignificanceOutcome> {
        SignificanceScratch& scratch = scratches[static_cast<size_t>(worker)];
        const PyramidTile& tile = *tiles[static_cast<size_t>(i)];
        TERRANE_TRY(findLayers(pyramid, needs, tile.id, scratch));
        TERRANE_TRY(pyramid.readRawHeights(tile, scratch.heights));
        const bool allCoded = interpolateInsignificant(scratch.significant, scratch.heights, scratch.states);
        const bool layered = keepLayersOfCoded(scratch);
        if (layered) TERRANE_TRY(pyramid.writeLayers(tile, scratch.layers));
        if (allCoded) return SignificanceOutcome{tile.rough, false, layered};
        TERRANE_TRY(pyramid.writeRawHeights(tile, scratch.heights));
        TERRANE_TRY(pyramid.writeStates(tile, scratch.states));
        return SignificanceOutcome{isRough(scratch.heights), true, layered};
      });
  if (!outcomes.ok()) return outcomes.error();
  for (size_t i = 0; i < tiles.size(); ++i) {
    tiles[i]->rough = (*outcomes)[i].rough;
    tiles[i]->hasStates = (*outcomes)[i].hasStates;
    tiles[i]->hasLayers = (*outcomes)[i].hasLayers;
  }
  return {};
}

}  // namespace terrane
