#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <glm/geometric.hpp>
#include <map>
#include <random>

#include "stage.h"
#include "vertex_capture.h"

namespace terrane {
namespace {

class PatchPlace : public testing::TestWithParam<gpu::Api> {
 protected:
  void SetUp() override {
    auto context = gpu::Context::createHeadless({.api = GetParam()});
    ASSERT_TRUE(context.ok()) << context.error().message;
    context_ = std::move(context).value();
  }
  std::unique_ptr<gpu::Context> context_;
};

/// All that is drawn at each point of the lattice must be the same, bit for bit, and lie where doubles put
/// it.
TEST_P(PatchPlace, SharedVerticesAreTheSameBitForBit) {
  VertexCapture capture(*context_);

  // A world of 1 m and one whose spacing is no binary number.
  int shared = 0;
  for (const double spacing : {1.0, 29.97}) {
    MadeUpWorld world = hillsWorld(2, spacing);
    world.frame.spacingY = spacing * 1.004;
    TileStore tiles(*context_);
    uploadAllTiles(world, tiles);

    // A cut of many levels, so that tiles of different levels meet.
    const PatchGrid grid{.k = 3};
    const int depth = 2;
    const Lattice lattice(depth);
    std::mt19937 random(11);
    const Cut cut = makeCut(grid, depth, grid.deepestLevel(2), [&](const Diamond& d) {
      return d.level < 6 || std::hypot(d.x - 300.0, d.y - 520.0) < 4.0 * lattice.halfSize(d.level);
    });
    std::uniform_real_distribution<double> share(-0.2, 1.2);
    const double side = world.sideMeters();
    for (int round = 0; round < 8; ++round) {
      const glm::dvec3 eye{share(random) * side, -share(random) * side,
                           300.0 + 3000.0 * std::abs(share(random))};
      const Camera camera = lookAt(eye, {share(random) * side, -share(random) * side, 500.0}, 0.9, 640, 360);
      const double exaggeration = round % 3 == 0 ? 1.7 : 1.0;

      std::map<LatticePoint, CapturedVertex> seen;
      for (const VertexCapture::Vertex& vertex : capture.run(cut, world.frame, tiles, camera, exaggeration)) {
        const LatticePoint at = vertex.at;
        const auto [first, isNew] = seen.try_emplace(at, vertex.captured);
        if (!isNew) {
          ++shared;
          ASSERT_EQ(std::memcmp(&first->second, &vertex.captured, sizeof(CapturedVertex)), 0)
              << at.x << " " << at.y << " round " << round;
        }
        // And where doubles put it: within a few roundings of the distance.
        const glm::dvec3 exact{at.x * world.frame.spacingX - eye.x, -at.y * world.frame.spacingY - eye.y,
                               hillsHeight(at.x, at.y) * exaggeration - eye.z};
        const auto& place = vertex.captured.place;
        const glm::dvec3 drawn{place[0], place[1], place[2]};
        ASSERT_LE(glm::length(drawn - exact), 0x1p-22 * glm::length(exact) + 1e-4) << at.x << " " << at.y;
      }
    }
  }
  std::printf("%d vertices met one that was there already\n", shared);
  EXPECT_GT(shared, 10000);
  EXPECT_TRUE(context_->checkErrors("capturing vertices").ok());
}

TEST(PatchPlacement, AnchorsStayWithinTheirIntegersFarOutside) {
  const MadeUpWorld world = hillsWorld(2);
  const Lattice deepest(kMaxLevel);
  for (const double far : {0.0, 1e7, -1e9, 1e15}) {
    const LatticePoint anchor = anchorNear(deepest, world.frame, {far, far, 0.0});
    for (const int64_t corner : {int64_t{0}, static_cast<int64_t>(deepest.side())}) {
      EXPECT_LT(std::abs(corner - anchor.x), int64_t{1} << 31);
      EXPECT_LT(std::abs(corner - anchor.y), int64_t{1} << 31);
    }
  }
}

/// The shader draws the template's triangles as lines of a grid and alternating diagonals: every edge of
/// every triangle must be one of those.
TEST(PatchTemplates, EdgesAreGridLinesOrTheAlternatingDiagonal) {
  for (int k = PatchGrid::kSmallest; k <= 5; ++k) {
    const PatchGrid grid{.k = k};
    for (int which = 0; which < 2; ++which) {
      const PatchTemplate source = which == 0 ? makeRightAngleTemplate(grid) : makeHypotenuseTemplate(grid);
      for (size_t i = 0; i < source.indices.size(); ++i) {
        const size_t next = i % 3 == 2 ? i - 2 : i + 1;
        const auto inGrid = [&](size_t index) {
          const LatticePoint p = source.vertices[source.indices[index]];
          if (which == 0) return p;
          return LatticePoint{(p.x + p.y) / 2, (p.x - p.y) / 2};
        };
        const LatticePoint a = inGrid(i);
        const LatticePoint b = inGrid(next);
        const int dx = b.x - a.x;
        const int dy = b.y - a.y;
        ASSERT_LE(std::abs(dx), 1);
        ASSERT_LE(std::abs(dy), 1);
        if (dx == 0 || dy == 0) continue;
        const bool falls = (std::min(a.x, b.x) + std::min(a.y, b.y)) % 2 == 0;
        EXPECT_EQ(dx == dy, falls);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(BothDialects, PatchPlace, testing::Values(gpu::Api::OpenGl, gpu::Api::OpenGlEs),
                         dialectName);

}  // namespace
}  // namespace terrane
