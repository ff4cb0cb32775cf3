#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <random>

#include "stage.h"
#include "vertex_capture.h"

namespace terrane {
namespace {

/// A cut of many levels whose diamonds are in all stages of their morph.
Cut randomMorphs(const PatchGrid& grid, int depth, std::mt19937& random) {
  const Lattice lattice(depth);
  const double x = std::uniform_real_distribution<double>(0, lattice.side())(random);
  const double y = std::uniform_real_distribution<double>(0, lattice.side())(random);
  Cut cut = makeCut(grid, depth, grid.deepestLevel(depth), [&](const Diamond& d) {
    return d.level < 3 || std::hypot(d.x - x, d.y - y) < 4.0 * lattice.halfSize(d.level);
  });
  morphAtRandom(cut, random);
  return cut;
}

std::unique_ptr<gpu::Context> contextOf(gpu::Api api) {
  auto context = gpu::Context::createHeadless({.api = api});
  TERRANE_CHECK(context.ok(), "{}", context.error().message);
  return std::move(context).value();
}

class PatchMorph : public testing::TestWithParam<gpu::Api> {
 protected:
  void SetUp() override { context_ = contextOf(GetParam()); }
  std::unique_ptr<gpu::Context> context_;
};

/// The height that a vertex must have, from the lattice's own words: the mean of the two ends of its
/// hypotenuse where the bintree parent lacks it.
struct Expected {
  bool isNew = false;
  float coarse = 0.0F;
  float own = 0.0F;
};
Expected expectedOf(const Lattice& lattice, const PatchGrid& grid, int patchLevel, LatticePoint at) {
  Expected out;
  out.own = hillsHeight(at.x, at.y);
  const bool isCorner = at.x % lattice.side() == 0 && at.y % lattice.side() == 0;
  if (isCorner) return out;
  const Diamond d = lattice.diamondAt(at);
  out.isNew = d.level == patchLevel + 2 * grid.k - 1;
  const auto ends = lattice.hypotenuse(d);
  out.coarse = 0.5F * (hillsHeight(ends[0].x, ends[0].y) + hillsHeight(ends[1].x, ends[1].y));
  return out;
}

/// Vertices glide from the mean of their hypotenuse's ends to themselves, and whatever shares a vertex shares
/// its height bit for bit, in both templates, all turns, many K, with neighbours in different stages.
TEST_P(PatchMorph, NewVerticesGlideAndSharedOnesAgree) {
  VertexCapture capture(*context_);
  const int depth = 2;
  const Lattice lattice(depth);
  const MadeUpWorld world = hillsWorld(depth, 9.7);
  TileStore tiles(*context_);
  uploadAllTiles(world, tiles);
  int shared = 0, gliding = 0;
  for (uint32_t seed = 0; seed < 14; ++seed) {
    std::mt19937 random(seed);
    const PatchGrid grid{.k = 1 + static_cast<int>(seed % 7)};
    const Cut cut = randomMorphs(grid, depth, random);
    const Camera camera = lookAt({2000.0, -2500.0, 4000.0}, {2500.0, -3000.0, 500.0}, 0.9, 64, 64);

    // What is at each place: the patches that have a vertex there, by their diamonds' levels and morphs.
    std::map<LatticePoint, CapturedVertex> seen;
    const auto vertices = capture.run(cut, world.frame, tiles, camera, 1.0);
    for (const auto& vertex : vertices) {
      const auto [first, isNew] = seen.try_emplace(vertex.at, vertex.captured);
      if (isNew) continue;
      ++shared;
      ASSERT_EQ(std::memcmp(&first->second, &vertex.captured, sizeof(CapturedVertex)), 0)
          << vertex.at.x << " " << vertex.at.y << " seed " << seed;
    }
    // Each patch's vertices against the lattice.
    for (const Patch& patch : cut.patches) {
      const PatchPlacement place = placePatch(lattice, grid, patch.triangle);
      const auto source =
          patch.triangle.diamond.isQuadCenter() ? makeRightAngleTemplate(grid) : makeHypotenuseTemplate(grid);
      for (const LatticePoint& v : source.vertices) {
        const LatticePoint turned = rotateQuarters(v, place.rotation);
        const LatticePoint at{place.origin.x + place.unit * turned.x, place.origin.y + place.unit * turned.y};
        const Expected expected = expectedOf(lattice, grid, patch.triangle.diamond.level, at);
        const float drawn = seen.at(at).height;
        if (!expected.isNew || patch.morph == 1.0F) {
          ASSERT_EQ(drawn, expected.own) << at.x << " " << at.y << " seed " << seed;
        } else if (patch.morph == 0.0F) {
          ASSERT_EQ(drawn, expected.coarse) << at.x << " " << at.y << " seed " << seed;
        } else {
          ++gliding;
          const float between = expected.coarse + patch.morph * (expected.own - expected.coarse);
          ASSERT_NEAR(drawn, between, 3e-4F) << at.x << " " << at.y << " seed " << seed;
        }
      }
    }
  }
  std::printf("%d vertices met one that was there already, %d were on their way\n", shared, gliding);
  EXPECT_GT(shared, 10000);
  EXPECT_GT(gliding, 10000);
  EXPECT_TRUE(context_->checkErrors("capturing vertices").ok());
}

/// At morph 0 a level of patches is the level above, wherever one looks.
TEST_P(PatchMorph, AtZeroThePatchIsItsParent) {
  VertexCapture capture(*context_);
  const int depth = 1;
  const MadeUpWorld world = hillsWorld(depth);
  TileStore tiles(*context_);
  uploadAllTiles(world, tiles);
  const Camera camera = lookAt({2000.0, -2500.0, 4000.0}, {2500.0, -3000.0, 500.0}, 0.9, 64, 64);
  for (const int level : {6, 7, 9, 10}) {
    const PatchGrid grid{.k = 3};
    std::map<LatticePoint, float> coarse;
    for (const auto& vertex : capture.run(makeFullCut(grid, depth, level), world.frame, tiles, camera, 1.0))
      coarse[vertex.at] = vertex.captured.height;
    Cut fine = makeFullCut(grid, depth, level + 1);
    for (Patch& patch : fine.patches) patch.morph = 0.0F;
    const Lattice lattice(depth);
    for (const auto& vertex : capture.run(fine, world.frame, tiles, camera, 1.0)) {
      const auto same = coarse.find(vertex.at);
      if (same != coarse.end()) {
        ASSERT_EQ(vertex.captured.height, same->second);
        continue;
      }
      const auto ends = lattice.hypotenuse(lattice.diamondAt(vertex.at));
      ASSERT_EQ(vertex.captured.height, 0.5F * (coarse.at(ends[0]) + coarse.at(ends[1])));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(BothDialects, PatchMorph, testing::Values(gpu::Api::OpenGl, gpu::Api::OpenGlEs),
                         dialectName);

/// Desktop and browser draw the same, bit for bit.
TEST(PatchMorphDialects, Agree) {
  std::array<std::vector<VertexCapture::Vertex>, 2> captured;
  for (size_t i = 0; i < 2; ++i) {
    const auto context = contextOf(i == 0 ? gpu::Api::OpenGl : gpu::Api::OpenGlEs);
    VertexCapture capture(*context);
    const MadeUpWorld world = hillsWorld(2, 9.7);
    TileStore tiles(*context);
    uploadAllTiles(world, tiles);
    std::mt19937 random(77);
    const Camera camera = lookAt({2000.0, -2500.0, 4000.0}, {2500.0, -3000.0, 500.0}, 0.9, 64, 64);
    captured[i] = capture.run(randomMorphs({.k = 4}, 2, random), world.frame, tiles, camera, 1.3);
  }
  ASSERT_EQ(captured[0].size(), captured[1].size());
  for (size_t i = 0; i < captured[0].size(); ++i) {
    ASSERT_EQ(captured[0][i].captured.height, captured[1][i].captured.height) << i;
    ASSERT_EQ(captured[0][i].captured.place, captured[1][i].captured.place) << i;
  }
}

}  // namespace
}  // namespace terrane
