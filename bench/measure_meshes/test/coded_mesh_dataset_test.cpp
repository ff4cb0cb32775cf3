#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "coded_mesh.h"
#include "function_source.h"
#include "look_at_mesh.h"
#include "stored_pyramid.h"
#include "temporary_directory.h"
#include "terrane/bake/build.h"

namespace terrane {
namespace {

constexpr int kWidth = 700;
constexpr int kHeight = 470;
constexpr double kBoundMeters = 9.0;

/// Rough ground with round holes of all sizes, and single samples that are missing.
float holedGround(int64_t x, int64_t y) {
  const double hole =
      std::hypot(std::remainder(static_cast<double>(x), 97.0), std::remainder(static_cast<double>(y), 61.0));
  const double radius = 30.0 * noiseAt((x + 48) / 97, (y + 30) / 61, 3);
  if (hole < radius || noiseAt(x, y, 5) > 0.999) return std::numeric_limits<float>::quiet_NaN();
  return roughGround(x, y, 11);
}

TEST(CodedMesh, CoversTheGroundOfADatasetWithinItsBound) {
  TemporaryDirectory folder;
  BuildOptions options;
  options.output = folder.file("a.terrane");
  SilentProgress silent;
  const FunctionSource source({{2, 0, 0, kWidth - 1, kHeight - 1, holedGround}}, 1.25 * kBoundMeters,
                              kBoundMeters);
  const auto built = buildDataset(source, options, silent);
  ASSERT_TRUE(built.ok()) << built.error().message;
  const auto pyramid = StoredPyramid::open(options.output);
  ASSERT_TRUE(pyramid.ok()) << pyramid.error().message;

  CodedMesh mesh;
  int64_t triangles = 0;
  int64_t cells = 0;
  const Status looked = pyramid->decodeAll([&](TileId id, const Tile& tile) -> Status {
    const auto listed = mesh.trianglesOf(tile.samples, id);
    EXPECT_FALSE(hasTVertices(listed)) << toString(id);
    const Looked seen(tile.samples, listed);
    EXPECT_LE(seen.largestError(), 1e-3) << toString(id);
    if (id.level < 2) return {};
    triangles += static_cast<int64_t>(listed.size());
    for (int cell = 0; cell < kTileCellCount; ++cell) {
      const bool isGround = tile.samples.coverage.covered(cell % kTileCells, cell / kTileCells);
      cells += isGround ? 1 : 0;
      for (const int quarter : {0, 1, 2, 3}) {
        const int times = seen.timesCovered(cell, quarter);
        EXPECT_TRUE(times == 1 || (times == 0 && !isGround)) << toString(id) << ", " << cell << ": " << times;
      }
    }
    // The mesh is the samples, and these are the source within the bound.
    for (int y = 0; y < kTileSamples; ++y) {
      for (int x = 0; x < kTileSamples; ++x) {
        const int64_t col = int64_t{id.col} * kTileCells + x;
        const int64_t row = int64_t{id.row} * kTileCells + y;
        const float expected = col < kWidth && row < kHeight ? holedGround(col, row) : std::nanf("");
        if (std::isnan(expected)) continue;
        const double height = tile.samples.heights[static_cast<size_t>(y * kTileSamples + x)];
        EXPECT_LE(std::abs(height - expected), kBoundMeters) << toString(id) << ", " << x << ", " << y;
      }
    }
    return {};
  });
  ASSERT_TRUE(looked.ok()) << looked.error().message;
  EXPECT_GT(cells, kWidth * kHeight / 2);
  EXPECT_LT(triangles, cells);
  EXPECT_GT(triangles, cells / 100);
}

}  // namespace
}  // namespace terrane
