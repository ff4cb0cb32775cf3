#include <algorithm>
#include <array>

#include "pyramid_steps.h"
#include "terrane/codec/elevation_codec.h"

namespace terrane {

namespace {

struct PruneScratch {
  TileSamples own;
  TileSamples parent;
};

bool sameCoverage(const Coverage& a, const Coverage& b) {
  return a.kind == b.kind && a.bits == b.bits;
}

/// Is the tile what interpolation makes of its parent? A coded sample that has the interpolated height and
/// is ground either way is no difference.
bool isInterpolated(const PruneScratch& scratch, int quadrant) {
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

Status pruneTiles(Pyramid& pyramid, Jobs& jobs) {
  std::vector<PruneScratch> scratches(static_cast<size_t>(jobs.workers().count()));
  for (int level = pyramid.finestLevel(); level >= 1; --level) {
    // A parent's children together; where all are rough there is nothing to ask.
    const auto& above = pyramid.levels[static_cast<size_t>(level) - 1];
    auto& tiles = pyramid.levels[static_cast<size_t>(level)];
    std::vector<const PyramidTile*> parents;
    for (const PyramidTile& parent : above) {
      if (std::any_of(parent.children.begin(), parent.children.end(),
                      [&](int32_t child) { return child >= 0 && !tiles[static_cast<size_t>(child)].rough; }))
        parents.push_back(&parent);
    }
    using Significant = std::array<bool, 4>;
    const auto outcomes = jobs.run<Significant>(
        fmt::format("pruning {}", level), static_cast<int64_t>(parents.size()), nullptr,
        [&](int worker, int64_t i) -> Result<Significant> {
          PruneScratch& scratch = scratches[static_cast<size_t>(worker)];
          const PyramidTile& parent = *parents[static_cast<size_t>(i)];
          Significant significant{true, true, true, true};
          TERRANE_TRY(pyramid.readSamples(parent, scratch.parent));
          for (size_t quadrant = 0; quadrant < 4; ++quadrant) {
            const int32_t child = parent.children[quadrant];
            if (child < 0 || tiles[static_cast<size_t>(child)].rough) continue;
            TERRANE_TRY(pyramid.readSamples(tiles[static_cast<size_t>(child)], scratch.own));
            significant[quadrant] = !isInterpolated(scratch, static_cast<int>(quadrant));
          }
          return significant;
        });
    if (!outcomes.ok()) return outcomes.error();
    for (size_t i = 0; i < parents.size(); ++i) {
      for (size_t quadrant = 0; quadrant < 4; ++quadrant) {
        const int32_t child = parents[i]->children[quadrant];
        if (child >= 0) tiles[static_cast<size_t>(child)].significant = (*outcomes)[i][quadrant];
      }
    }
    decideStored(pyramid, level);
  }
  return {};
}

}  // namespace terrane
