#include "pyramid.h"

#include <algorithm>

namespace terrane {

Pyramid::Pyramid(int finestLevel, const Scratch& scratch, int layerCount)
    : levels(static_cast<size_t>(finestLevel) + 1),
      nodes(static_cast<size_t>(finestLevel) + 1),
      layerCount_(layerCount),
      raw_(kTileSampleCount * sizeof(float), scratch, "raw"),
      filled_(kTileSampleCount * sizeof(float), scratch, "filled"),
      states_(kTileSampleCount * sizeof(SampleState), scratch, "states"),
      layers_(kTileSampleCount, scratch, "layers"),
      coverage_(Coverage::kBytes, scratch, "coverage") {}

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

Status Pyramid::readRawHeights(const PyramidTile& tile, std::span<float> heights) const {
  return raw_.readValues<float>(static_cast<uint64_t>(tile.block), heights);
}

Status Pyramid::writeRawHeights(const PyramidTile& tile, std::span<const float> heights) {
  return raw_.writeValues<float>(static_cast<uint64_t>(tile.block), heights);
}

Status Pyramid::readHeights(const PyramidTile& tile, std::span<float> heights) const {
  return (tile.filled ? filled_ : raw_).readValues<float>(static_cast<uint64_t>(tile.block), heights);
}

Status Pyramid::writeFilledHeights(const PyramidTile& tile, std::span<const float> heights) {
  return filled_.writeValues<float>(static_cast<uint64_t>(tile.block), heights);
}

Result<float> Pyramid::readHeight(const PyramidTile& tile, int x, int y) const {
  float height = 0.0F;
  const size_t offset = static_cast<size_t>(y * kTileSamples + x) * sizeof(float);
  TERRANE_TRY(
      (tile.filled ? filled_ : raw_)
          .read(static_cast<uint64_t>(tile.block), std::as_writable_bytes(std::span(&height, 1)), offset));
  return height;
}

Status Pyramid::readStates(const PyramidTile& tile, std::span<SampleState> states) const {
  if (tile.hasStates) return states_.readValues<SampleState>(static_cast<uint64_t>(tile.block), states);
  std::fill(states.begin(), states.end(), SampleState::Coded);
  return {};
}

Status Pyramid::writeStates(const PyramidTile& tile, std::span<const SampleState> states) {
  return states_.writeValues<SampleState>(static_cast<uint64_t>(tile.block), states);
}

Status Pyramid::readLayers(const PyramidTile& tile, std::span<uint8_t> layers) const {
  if (tile.hasLayers) return layers_.readValues<uint8_t>(static_cast<uint64_t>(tile.block), layers);
  std::fill(layers.begin(), layers.end(), uint8_t{0});
  return {};
}

Status Pyramid::writeLayers(const PyramidTile& tile, std::span<const uint8_t> layers) {
  return layers_.writeValues<uint8_t>(static_cast<uint64_t>(tile.block), layers);
}

Status Pyramid::readCoverage(const PyramidTile& tile, Coverage& coverage) const {
  coverage.kind = tile.coverage;
  coverage.bits.clear();
  if (tile.coverage != Coverage::Kind::Partial) return {};
  coverage.bits.resize(Coverage::kBytes);
  return coverage_.readValues<uint8_t>(static_cast<uint64_t>(tile.block), coverage.bits);
}

Status Pyramid::writeCoverageBits(const PyramidTile& tile, std::span<const uint8_t> bits) {
  return coverage_.writeValues<uint8_t>(static_cast<uint64_t>(tile.block), bits);
}

Status Pyramid::readSamples(const PyramidTile& tile, TileSamples& samples) const {
  samples.heights.resize(kTileSampleCount);
  samples.states.resize(kTileSampleCount);
  samples.layerCount = layerCount_;
  samples.layers.resize(tile.hasLayers ? kTileSampleCount : 0);
  if (tile.hasLayers) TERRANE_TRY(readLayers(tile, samples.layers));
  TERRANE_TRY(readCoverage(tile, samples.coverage));
  TERRANE_TRY(readHeights(tile, samples.heights));
  return readStates(tile, samples.states);
}

}  // namespace terrane
