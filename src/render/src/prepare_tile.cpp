#include "terrane/render/prepare_tile.h"

#include <algorithm>

#include "prepared_tile.h"
#include "terrane/codec/packed.h"

namespace terrane {

namespace {

/// The cells that are shown: those that are ground and have ground at all four corners. note: a coarse cell
/// is ground when half of it is, so a corner may lie beyond; between it and the last ground the surface runs
/// to a height that only fills a gap, which would stand there as a wall.
Coverage shownCells(const TileSamples& samples) {
  const auto isVoid = [&](int col, int row) {
    return samples.states[static_cast<size_t>(row * kTileSamples + col)] == SampleState::Void;
  };
  if (samples.coverage.kind == Coverage::Kind::None ||
      std::find(samples.states.begin(), samples.states.end(), SampleState::Void) == samples.states.end())
    return samples.coverage;

  Coverage out{.kind = Coverage::Kind::Partial, .bits = std::vector<uint8_t>(Coverage::kBytes, 0)};
  int shown = 0;
  for (int row = 0; row < kTileCells; ++row) {
    for (int col = 0; col < kTileCells; ++col) {
      if (!samples.coverage.covered(col, row) || isVoid(col, row) || isVoid(col + 1, row) ||
          isVoid(col, row + 1) || isVoid(col + 1, row + 1))
        continue;
      const int cell = row * kTileCells + col;
      out.bits[static_cast<size_t>(cell >> 3)] |= static_cast<uint8_t>(1U << (cell & 7));
      ++shown;
    }
  }
  if (shown == 0) return {};
  return out;
}

}  // namespace

std::shared_ptr<const PreparedTile> prepareTile(const TileSamples& samples) {
  auto out = std::make_shared<PreparedTile>();
  out->shown = shownCells(samples);
  out->shading = makeTileShading(samples.heights, out->shown);
  return out;
}

void pack(Packer& packer, const PreparedTile& prepared) {
  const TileShading& shading = prepared.shading;
  packer.reserve(shading.atlas.size() * sizeof(PackedGradient) +
                 shading.borders.values().size() * sizeof(Gradient) + Coverage::kBytes + 64);
  pack(packer, prepared.shown);
  packer.array(shading.atlas);
  packer.array(shading.borders.values());
}
std::shared_ptr<const PreparedTile> unpackPrepared(Unpacker& unpacker) {
  auto out = std::make_shared<PreparedTile>();
  out->shown = unpackCoverage(unpacker);
  out->shading.atlas = unpacker.array<PackedGradient>(size_t{kAtlasWidth} * kAtlasHeight);
  std::vector<Gradient>& borders = out->shading.borders.values();
  borders = unpacker.array<Gradient>(borders.size());
  return out;
}

}  // namespace terrane
