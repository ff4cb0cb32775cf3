#include "pyramid.h"

#include <algorithm>

namespace terrane {

Pyramid::Pyramid(int finestLevel, uint64_t memoryBytes, const std::string& scratchFolder)
    : levels(static_cast<size_t>(finestLevel) + 1),
      nodes(static_cast<size_t>(finestLevel) + 1),
      heights_(kTileSampleCount * sizeof(float), memoryBytes / 5 * 4, scratchFolder),
      states_(kTileSampleCount * sizeof(SampleState), memoryBytes / 5, scratchFolder) {}

int Pyramid::find(TileId id) const {
  const auto& tiles = levels[static_cast<size_t>(id.level)];
  const auto at = std::lower_bound(tiles.begin(), tiles.end(), id,
                                   [](const PyramidTile& tile, TileId wanted) { return tile.id < wanted; });
  return at != tiles.end() && at->id == id ? static_cast<int>(at - tiles.begin()) : -1;
}

void Pyramid::link() {
  for (size_t level = 1; level < levels.size(); ++level) {
    for (size_t i = 0; i < levels[level].size(); ++i) {
      const TileId id = levels[level][i].id;
      const int parent = find(id.parent());
      TERRANE_CHECK(parent >= 0, "{} has no parent", toString(id));
      levels[level - 1][static_cast<size_t>(parent)].children[static_cast<size_t>(id.quadrant())] =
          static_cast<int>(i);
    }
  }
}

Pyramid::PlacedPoint Pyramid::findStored(int level, LatticePoint point) const {
  for (const int dx : {0, 1}) {
    for (const int dy : {0, 1}) {
      if ((dx == 1 && point.x % kTileCells != 0) || (dy == 1 && point.y % kTileCells != 0)) continue;
      const TileId id{level, point.x / kTileCells - dx, point.y / kTileCells - dy};
      const int index = id.valid() ? find(id) : -1;
      if (index < 0 || !levels[static_cast<size_t>(level)][static_cast<size_t>(index)].stored) continue;
      return {index, {point.x - id.col * kTileCells, point.y - id.row * kTileCells}};
    }
  }
  return {};
}

bool Pyramid::isStored(TileId id) const {
  if (id.level < 0 || id.level > finestLevel()) return false;
  const int index = find(id);
  return index >= 0 && levels[static_cast<size_t>(id.level)][static_cast<size_t>(index)].stored;
}

Status Pyramid::readHeights(const PyramidTile& tile, std::span<float> heights) const {
  return heights_.readValues<float>(static_cast<uint64_t>(tile.heights), heights);
}

Status Pyramid::writeHeights(PyramidTile& tile, std::span<const float> heights) {
  if (tile.heights < 0) tile.heights = nextHeights_.fetch_add(1);
  return heights_.writeValues<float>(static_cast<uint64_t>(tile.heights), heights);
}

Result<float> Pyramid::readHeight(const PyramidTile& tile, int x, int y) const {
  float height = 0.0F;
  const size_t offset = static_cast<size_t>(y * kTileSamples + x) * sizeof(float);
  TERRANE_TRY(heights_.read(static_cast<uint64_t>(tile.heights),
                            std::as_writable_bytes(std::span(&height, 1)), offset));
  return height;
}

Status Pyramid::readStates(const PyramidTile& tile, std::span<SampleState> states) const {
  if (tile.states >= 0) return states_.readValues<SampleState>(static_cast<uint64_t>(tile.states), states);
  std::fill(states.begin(), states.end(), SampleState::Coded);
  return {};
}

Status Pyramid::writeStates(PyramidTile& tile, std::span<const SampleState> states) {
  if (tile.states < 0) tile.states = nextStates_.fetch_add(1);
  return states_.writeValues<SampleState>(static_cast<uint64_t>(tile.states), states);
}

Status Pyramid::readSamples(const PyramidTile& tile, TileSamples& samples) const {
  samples.heights.resize(kTileSampleCount);
  samples.states.resize(kTileSampleCount);
  samples.coverage = tile.coverage;
  TERRANE_TRY(readHeights(tile, samples.heights));
  return readStates(tile, samples.states);
}

}  // namespace terrane
