#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <random>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "terrane/codec/tile.h"
#include "terrane/lod/cut.h"
#include "terrane/tiling/frame.h"
#include "terrane/tiling/lattice.h"

namespace terrane {

/// A small world whose heights are a function of position, so that every sample of every tile is known.
struct MadeUpWorld {
  Frame frame;
  std::function<float(int64_t x, int64_t y)> height;  ///< at a sample of the finest data level
  std::function<bool(int64_t x, int64_t y)> ground = [](int64_t, int64_t) {
    return true;
  };  ///< at a finest cell

  Tile tile(TileId id) const {
    Tile out;
    const int64_t step = int64_t{1} << (frame.finestLevel - id.level);
    const auto sample = [&](int tileCoordinate, int inTile) {
      return (static_cast<int64_t>(tileCoordinate) * kTileCells + inTile) * step;
    };
    for (int y = 0; y < kTileSamples; ++y)
      for (int x = 0; x < kTileSamples; ++x)
        out.samples.heights.push_back(height(sample(id.col, x), sample(id.row, y)));
    out.samples.states.assign(kTileSampleCount, SampleState::Coded);

    // Coarse cells ask at their middle: enough for a test.
    Coverage& coverage = out.samples.coverage;
    coverage.bits.assign(Coverage::kBytes, 0);
    int count = 0;
    for (int cell = 0; cell < kTileCellCount; ++cell) {
      if (!ground(sample(id.col, cell % kTileCells) + step / 2, sample(id.row, cell / kTileCells) + step / 2))
        continue;
      coverage.bits[static_cast<size_t>(cell >> 3)] =
          static_cast<uint8_t>(coverage.bits[static_cast<size_t>(cell >> 3)] | 1U << (cell & 7));
      ++count;
    }
    coverage.kind = count == 0                ? Coverage::Kind::None
                    : count == kTileCellCount ? Coverage::Kind::Full
                                              : Coverage::Kind::Partial;
    if (coverage.kind != Coverage::Kind::Partial) coverage.bits.clear();
    return out;
  }

  /// Metres along the world's side.
  double sideMeters() const { return static_cast<double>(frame.worldCells()) * frame.spacingXMeters(); }
};

/// Smooth hills and valleys with some roughness, metres, for a spacing of ten metres.
inline float hillsHeight(int64_t x, int64_t y) {
  const double u = static_cast<double>(x) * 0.01;
  const double v = static_cast<double>(y) * 0.01;
  double height = 600.0;
  double size = 420.0;
  double pitch = 0.55;
  for (int octave = 0; octave < 8; ++octave) {
    const double turn = 0.7 * octave;
    const double a = (u * std::cos(turn) + v * std::sin(turn)) * pitch;
    const double b = (v * std::cos(turn) - u * std::sin(turn)) * pitch;
    height += size * (1.0 - std::abs(std::sin(a + 0.7 * std::sin(b)))) * (0.6 + 0.4 * std::cos(1.3 * b));
    size *= 0.45;
    pitch *= 2.13;
  }
  return static_cast<float>(height);
}

inline MadeUpWorld hillsWorld(int finestLevel, double spacing = 10.0) {
  MadeUpWorld world;
  world.frame = {.originEasting = 500000.0,
                 .originNorthing = 5200000.0,
                 .spacingX = spacing,
                 .spacingY = spacing,
                 .finestLevel = finestLevel};
  world.height = hillsHeight;
  return world;
}

/// The height of the finest triangulation at a local point: the lattice's triangles, found by splitting
/// cells.
inline double surfaceHeight(const MadeUpWorld& world, glm::dvec2 local, int step) {
  const glm::dvec2 sample = world.frame.sampleFromLocal(local) / static_cast<double>(step);
  const auto x = static_cast<int64_t>(std::floor(sample.x));
  const auto y = static_cast<int64_t>(std::floor(sample.y));
  const double u = sample.x - static_cast<double>(x);
  const double v = sample.y - static_cast<double>(y);
  const auto h = [&](int64_t dx, int64_t dy) {
    return static_cast<double>(world.height((x + dx) * step, (y + dy) * step));
  };
  // Right-angle patches put the diagonal of a cell from north-west to south-east where its coordinates sum up
  // even.
  if ((x + y) % 2 == 0) {
    if (u >= v) return h(0, 0) + u * (h(1, 0) - h(0, 0)) + v * (h(1, 1) - h(1, 0));
    return h(0, 0) + v * (h(0, 1) - h(0, 0)) + u * (h(1, 1) - h(0, 1));
  }
  if (u + v <= 1.0) return h(0, 0) + u * (h(1, 0) - h(0, 0)) + v * (h(0, 1) - h(0, 0));
  return h(1, 1) + (1.0 - u) * (h(0, 1) - h(1, 1)) + (1.0 - v) * (h(1, 0) - h(1, 1));
}

/// Splits the world's diamonds wherever `wants` says so, and whatever must be split before them, down to
/// bintree level `deepest`: a conforming cut. Below a diamond that is not wanted nothing is asked.
inline Cut makeCut(const PatchGrid& grid, int latticeDepth, int deepest,
                   const std::function<bool(const Diamond&)>& wants) {
  Cut cut;
  cut.latticeDepth = latticeDepth;
  cut.grid = grid;
  const Lattice lattice(latticeDepth);
  std::unordered_set<Diamond, DiamondHash> asked;
  std::unordered_set<Diamond, DiamondHash> split;
  std::function<void(const Diamond&)> splitWithParents = [&](const Diamond& d) {
    if (!split.insert(d).second) return;
    for (const Diamond& parent : lattice.parents(d)) splitWithParents(parent);
  };
  std::function<void(const Diamond&)> explore = [&](const Diamond& d) {
    if (!asked.insert(d).second || d.level >= deepest || !wants(d)) return;
    splitWithParents(d);
    for (const Diamond& child : lattice.children(d)) explore(child);
  };
  explore(lattice.rootTriangles().begin()->diamond);
  std::function<void(const Triangle&)> visit = [&](const Triangle& t) {
    if (split.count(t.diamond) != 0) {
      // The two halves: those of the split diamond's triangles that lie on this side of the hypotenuse.
      const auto ends = lattice.hypotenuse(t.diamond);
      for (const Triangle& half : lattice.trianglesAfterSplit(t.diamond)) {
        // A half's hypotenuse joins this triangle's apex with one end of its hypotenuse.
        const auto legs = lattice.hypotenuse(half.diamond);
        const bool mine = legs[0] == t.apex || legs[1] == t.apex;
        const bool end = legs[0] == ends[0] || legs[0] == ends[1] || legs[1] == ends[0] || legs[1] == ends[1];
        if (mine && end) visit(half);
      }
      return;
    }
    const int tileLevel = grid.tileLevel(t.diamond.level);
    const TileId tile = lattice.tileOf(t, tileLevel);
    cut.patches.push_back({.triangle = t, .tile = tile, .shadingTile = tile, .errorPixels = 0.5F});
  };
  for (const Triangle& t : lattice.rootTriangles()) visit(t);
  return cut;
}

/// Gives every diamond of a cut that has split a morph of its own, random, but 1 where a child has split, as
/// selection sees to.
inline void morphAtRandom(Cut& cut, std::mt19937& random) {
  const Lattice lattice(cut.latticeDepth);
  constexpr std::array<float, 6> kSome = {0.0F, 0.25F, 0.3F, 0.777F, 0.999F, 1.0F};
  std::unordered_map<Diamond, float, DiamondHash> morphs;
  const auto parentOf = [](const Patch& patch) {
    return Diamond{patch.triangle.apex.x, patch.triangle.apex.y, patch.triangle.diamond.level - 1};
  };
  for (const Patch& patch : cut.patches) morphs[parentOf(patch)] = kSome[random() % kSome.size()];
  for (const Patch& patch : cut.patches) {
    if (patch.triangle.diamond.level == 0) continue;
    for (const Diamond& above : lattice.parents(parentOf(patch)))
      if (const auto at = morphs.find(above); at != morphs.end()) at->second = 1.0F;
  }
  for (Patch& patch : cut.patches)
    patch.morph = patch.triangle.diamond.level == 0 ? 1.0F : morphs.at(parentOf(patch));
}

/// All triangles of one bintree level.
inline Cut makeFullCut(const PatchGrid& grid, int latticeDepth, int level) {
  return makeCut(grid, latticeDepth, level, [](const Diamond&) { return true; });
}

}  // namespace terrane
