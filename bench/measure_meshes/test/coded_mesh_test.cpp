#include "coded_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <utility>

#include "look_at_mesh.h"
#include "terrane/tiling/lattice.h"

namespace terrane {
namespace {

/// Diamonds of a tile from coarse to fine, by the lattice's own arithmetic; the tile's corners are left out.
std::vector<std::pair<Diamond, size_t>> diamondsOf(TileId id) {
  const Lattice lattice(id.level);
  std::vector<std::pair<Diamond, size_t>> out;
  for (int y = 0; y < kTileSamples; ++y) {
    for (int x = 0; x < kTileSamples; ++x) {
      if (x % kTileCells == 0 && y % kTileCells == 0) continue;
      const Diamond d = lattice.diamondAt({id.col * kTileCells + x, id.row * kTileCells + y});
      out.emplace_back(d, static_cast<size_t>(y * kTileSamples + x));
    }
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const auto& a, const auto& b) { return a.first.level < b.first.level; });
  return out;
}

struct RandomStates {
  double coded = 0.01;
  double isVoid = 0.0;
  int smallest = 1;  ///< samples off its multiples are not Coded
};

/// A tile with samples Coded here and there, of random heights, and the others as the codec has them.
TileSamples randomSamples(TileId id, const RandomStates& states, std::mt19937& random) {
  TileSamples samples;
  samples.heights.assign(kTileSampleCount, 0.0F);
  samples.states.assign(kTileSampleCount, SampleState::Coded);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const auto roll = [&] { return static_cast<float>(std::floor(share(random) * 4000.0)); };
  for (const int y : {0, kTileCells}) {
    for (const int x : {0, kTileCells}) samples.heights[static_cast<size_t>(y * kTileSamples + x)] = roll();
  }
  const Lattice lattice(id.level);
  for (const auto& [diamond, index] : diamondsOf(id)) {
    const int x = diamond.x - id.col * kTileCells;
    const int y = diamond.y - id.row * kTileCells;
    const double dice = share(random);
    const bool isVoid = dice < states.isVoid;
    const bool isCoded = !isVoid && x % states.smallest == 0 && y % states.smallest == 0 &&
                         dice < states.isVoid + states.coded;
    float sum = 0.0F;
    for (const LatticePoint end : lattice.hypotenuse(diamond)) {
      sum += samples.heights[static_cast<size_t>((end.y - id.row * kTileCells) * kTileSamples +
                                                 (end.x - id.col * kTileCells))];
    }
    samples.heights[index] = isCoded ? roll() : sum * 0.5F;
    samples.states[index] = isVoid    ? SampleState::Void
                            : isCoded ? SampleState::Coded
                                      : SampleState::Interpolated;
  }
  return samples;
}

class CodedMeshOnTiles : public testing::TestWithParam<TileId> {};

TEST_P(CodedMeshOnTiles, CoversTheTileOnceAndIsItsSurface) {
  std::mt19937 random(7);
  CodedMesh mesh;
  for (const RandomStates& states : std::initializer_list<RandomStates>{
           {0.0, 0.0, 1}, {0.0002, 0.0, 1}, {0.02, 0.0, 1}, {0.5, 0.0, 8}, {0.3, 0.0, 1}, {1.0, 0.0, 1}}) {
    const TileSamples samples = randomSamples(GetParam(), states, random);
    const auto triangles = mesh.trianglesOf(samples, GetParam());
    const Looked looked(samples, triangles);
    for (int cell = 0; cell < kTileCellCount; ++cell) {
      for (const int quarter : {0, 1, 2, 3})
        ASSERT_EQ(looked.timesCovered(cell, quarter), 1) << cell << ", " << quarter << ", " << states.coded;
    }
    EXPECT_FALSE(hasTVertices(triangles)) << states.coded;
    // Means of means are rounded to floats, planes are not.
    EXPECT_LE(looked.largestError(), 2e-3) << states.coded;
  }
}

TEST_P(CodedMeshOnTiles, LeavesOutWhatHasACornerWithoutAHeight) {
  std::mt19937 random(8);
  CodedMesh mesh;
  const TileSamples samples = randomSamples(GetParam(), {0.05, 0.01, 1}, random);
  const auto triangles = mesh.trianglesOf(samples, GetParam());
  for (const CodedTriangle& triangle : triangles) {
    for (const uint32_t corner : triangle) ASSERT_NE(samples.states[corner], SampleState::Void);
  }
  EXPECT_FALSE(hasTVertices(triangles));
  const Looked looked(samples, triangles);
  EXPECT_LE(looked.largestError(), 2e-3);

  // With heights on what was void there are the same triangles and the missing ones.
  TileSamples filled = samples;
  CodedMesh other;
  std::replace(filled.states.begin(), filled.states.end(), SampleState::Void, SampleState::Interpolated);
  const auto all = other.trianglesOf(filled, GetParam());
  const std::set<CodedTriangle> kept(triangles.begin(), triangles.end());
  for (const CodedTriangle& triangle : all) {
    const bool isGround = std::none_of(triangle.begin(), triangle.end(), [&](uint32_t corner) {
      return samples.states[corner] == SampleState::Void;
    });
    ASSERT_EQ(kept.count(triangle) != 0, isGround);
  }
}

INSTANTIATE_TEST_SUITE_P(BothDiagonals, CodedMeshOnTiles,
                         testing::Values(TileId{0, 0, 0}, TileId{3, 4, 1}, TileId{3, 5, 3}));

TEST(CodedMesh, HasTheFewestAndTheMostTriangles) {
  std::mt19937 random(9);
  CodedMesh mesh;
  const TileId id{2, 1, 2};
  EXPECT_EQ(mesh.trianglesOf(randomSamples(id, {0.0, 0.0, 1}, random), id).size(), 2U);
  EXPECT_EQ(mesh.trianglesOf(randomSamples(id, {1.0, 0.0, 16}, random), id).size(), 512U);
  EXPECT_EQ(mesh.trianglesOf(randomSamples(id, {1.0, 0.0, 1}, random), id).size(), 131072U);
  TileSamples nothing = randomSamples(id, {0.0, 0.0, 1}, random);
  std::fill(nothing.states.begin(), nothing.states.end(), SampleState::Void);
  EXPECT_EQ(mesh.trianglesOf(nothing, id).size(), 0U);
}

}  // namespace
}  // namespace terrane
