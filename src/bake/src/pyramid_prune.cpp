#include <algorithm>

#include "pyramid_steps.h"
#include "terrane/codec/elevation_codec.h"

namespace terrane {

namespace {

struct Scratch {
  TileSamples own;
  TileSamples parent;
};

bool sameCoverage(const Coverage& a, const Coverage& b) {
  return a.kind == b.kind && a.bits == b.bits;
}

/// Is the tile what interpolation makes of its parent? A coded sample that has the interpolated height and
/// is ground either way is no difference.
bool isInterpolated(const Scratch& scratch, int quadrant) {
  const TileSamples expected = interpolateSamples(scratch.parent, quadrant);
  const auto isGround = [](SampleState state) { return state != SampleState::Void; };
  return expected.heights == scratch.own.heights && sameCoverage(expected.coverage, scratch.own.coverage) &&
         std::equal(expected.states.begin(), expected.states.end(), scratch.own.states.begin(),
                    [&](SampleState a, SampleState b) { return isGround(a) == isGround(b); });
}

/// Stored are tiles that are significant, lie above a stored one, or touch a significant one. note: the last
/// because a diamond on the border splits only with its other half: the neighbour must tell how much its
/// nodes are saturated by what lies across.
void decideStored(Pyramid& pyramid, int level) {
  auto& tiles = pyramid.levels[static_cast<size_t>(level)];
  for (PyramidTile& tile : tiles) {
    tile.stored =
        tile.significant || std::any_of(tile.children.begin(), tile.children.end(), [&](int32_t child) {
          return child >= 0 &&
                 pyramid.levels[static_cast<size_t>(level) + 1][static_cast<size_t>(child)].stored;
        });
  }
  for (const PyramidTile& tile : tiles) {
    if (!tile.significant) continue;
    for (int row = tile.id.row - 1; row <= tile.id.row + 1; ++row) {
      for (int col = tile.id.col - 1; col <= tile.id.col + 1; ++col) {
        const TileId id{level, col, row};
        const int index = id.valid() ? pyramid.find(id) : -1;
        if (index >= 0) tiles[static_cast<size_t>(index)].stored = true;
      }
    }
  }
}

}  // namespace

Status pruneTiles(Pyramid& pyramid, const Workers& workers) {
  std::vector<Scratch> scratches(static_cast<size_t>(workers.count()));
  for (int level = pyramid.finestLevel(); level >= 1; --level) {
    auto& parents = pyramid.levels[static_cast<size_t>(level) - 1];
    auto& tiles = pyramid.levels[static_cast<size_t>(level)];
    const Status done =
        workers.forEach(static_cast<int64_t>(parents.size()), [&](int worker, int64_t i) -> Status {
          Scratch& scratch = scratches[static_cast<size_t>(worker)];
          const PyramidTile& parent = parents[static_cast<size_t>(i)];
          bool parentRead = false;
          for (int quadrant = 0; quadrant < 4; ++quadrant) {
            const int32_t child = parent.children[static_cast<size_t>(quadrant)];
            if (child < 0) continue;
            PyramidTile& tile = tiles[static_cast<size_t>(child)];
            if (tile.rough) continue;
            if (!parentRead) TERRANE_TRY(pyramid.readSamples(parent, scratch.parent));
            parentRead = true;
            TERRANE_TRY(pyramid.readSamples(tile, scratch.own));
            tile.significant = !isInterpolated(scratch, quadrant);
          }
          return {};
        });
    TERRANE_TRY(done);
    decideStored(pyramid, level);
  }
  return {};
}

}  // namespace terrane
