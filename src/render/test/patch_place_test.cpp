#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <map>
#include <random>

#include "frame_block.h"
#include "made_up_world.h"
#include "patch_drawer.h"
#include "shader_library.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/framebuffer.h"
#include "terrane/tiling/patch_template.h"

namespace terrane {
namespace {

/// What the vertex stage made of one vertex.
struct Captured {
  std::array<float, 4> clip;
  std::array<float, 3> place;
};
static_assert(sizeof(Captured) == 28);

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
  auto program = makeProgram(*context_, ProgramRecipes().shade, {"gl_Position", "vPlace"});
  ASSERT_TRUE(program.ok()) << program.error().message;
  TileStore::setSamplers(*program);

  // note: without a framebuffer nothing is drawn, even where nothing is rasterised.
  const auto target = gpu::Framebuffer::create(*context_, {.width = 4, .height = 4});
  ASSERT_TRUE(target.ok()) << target.error().message;
  target->bind();

  // A world of 1 m and one whose spacing is no binary number.
  int shared = 0;
  for (const double spacing : {1.0, 29.97}) {
    MadeUpWorld world = hillsWorld(2, spacing);
    world.frame.spacingY = spacing * 1.004;
    TileStore tiles(*context_);
    for (int level = 0; level <= 2; ++level)
      for (int row = 0; row < 1 << level; ++row)
        for (int col = 0; col < 1 << level; ++col)
          const Tile tile = world.tile({level, col, row});
          ASSERT_TRUE(tiles.upload({level, col, row}, tile.samples, *prepareTile(tile)).ok());

    // A cut of many levels, so that tiles of different levels meet.
    const PatchGrid grid{.k = 3};
    const int depth = 2;
    const Lattice lattice(depth);
    std::mt19937 random(11);
    const Cut cut = makeCut(grid, depth, grid.deepestLevel(2), [&](const Diamond& d) {
      return d.level < 6 || std::hypot(d.x - 300.0, d.y - 520.0) < 4.0 * lattice.halfSize(d.level);
    });
    const std::array<PatchTemplate, 2> templates = {makeRightAngleTemplate(grid),
                                                    makeHypotenuseTemplate(grid)};
    PatchDrawer drawer;
    gpu::Buffer uniforms(GL_UNIFORM_BUFFER);
    gpu::Buffer feedback(GL_TRANSFORM_FEEDBACK_BUFFER);

    std::uniform_real_distribution<double> share(-0.2, 1.2);
    const double side = world.sideMeters();
    for (int round = 0; round < 8; ++round) {
      const glm::dvec3 eye{share(random) * side, -share(random) * side,
                           300.0 + 3000.0 * std::abs(share(random))};
      const Camera camera = lookAt(eye, {share(random) * side, -share(random) * side, 500.0}, 0.9, 640, 360);
      const double exaggeration = round % 3 == 0 ? 1.7 : 1.0;
      RenderStyle style;
      style.exaggeration = exaggeration;
      const LatticePoint anchor = anchorNear(lattice, world.frame, eye);
      const auto instances = makePatchInstances(cut, world.frame, anchor, tiles);
      ASSERT_TRUE(instances.ok()) << instances.error().message;
      FrameBlock block =
          makeFrameBlock(world.frame, camera, style, chooseDepthRange(*context_, world.frame, camera), 1);
      placeLattice(block, world.frame, camera, exaggeration, depth, anchor, grid.cellsPerSide());
      drawer.setInstances(grid, *instances);
      tiles.bind();
      uniforms.upload(&block, sizeof(block));
      glBindBufferBase(GL_UNIFORM_BUFFER, kFrameBinding, uniforms.name());

      std::map<LatticePoint, Captured> seen;
      for (int which = 0; which < 2; ++which) {
        const auto& group = instances->byTemplate[static_cast<size_t>(which)];
        const auto& vertices = templates[static_cast<size_t>(which)].vertices;
        const size_t count = group.size() * vertices.size();
        ASSERT_GT(count, 0U);
        feedback.upload(nullptr, count * sizeof(Captured));
        program->use();
        glEnable(GL_RASTERIZER_DISCARD);
        glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, feedback.name());
        program->setInt("uTemplate", which);
        glBeginTransformFeedback(GL_POINTS);
        EXPECT_EQ(drawer.drawPoints(which), static_cast<int64_t>(count));
        glEndTransformFeedback();
        glDisable(GL_RASTERIZER_DISCARD);
        feedback.bind();
        std::vector<Captured> captured(count);
        const void* mapped =
            glMapBufferRange(GL_TRANSFORM_FEEDBACK_BUFFER, 0,
                             static_cast<GLsizeiptr>(count * sizeof(Captured)), GL_MAP_READ_BIT);
        ASSERT_NE(mapped, nullptr);
        std::memcpy(captured.data(), mapped, count * sizeof(Captured));
        glUnmapBuffer(GL_TRANSFORM_FEEDBACK_BUFFER);

        for (size_t i = 0; i < count; ++i) {
          const PatchInstance& instance = group[i / vertices.size()];
          const LatticePoint turned = rotateQuarters(vertices[i % vertices.size()], instance.lattice[3]);
          const LatticePoint at{instance.lattice[0] + anchor.x + turned.x * instance.lattice[2],
                                instance.lattice[1] + anchor.y + turned.y * instance.lattice[2]};
          const auto [first, isNew] = seen.try_emplace(at, captured[i]);
          if (!isNew) {
            ++shared;
            ASSERT_EQ(std::memcmp(&first->second, &captured[i], sizeof(Captured)), 0)
                << at.x << " " << at.y << " round " << round;
          }
          // And where doubles put it: within a few roundings of the distance.
          const glm::dvec3 exact{at.x * world.frame.spacingX - eye.x, -at.y * world.frame.spacingY - eye.y,
                                 hillsHeight(at.x, at.y) * exaggeration - eye.z};
          const glm::dvec3 drawn{captured[i].place[0], captured[i].place[1], captured[i].place[2]};
          ASSERT_LE(glm::length(drawn - exact), 0x1p-22 * glm::length(exact) + 1e-4) << at.x << " " << at.y;
        }
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

std::string dialectName(const testing::TestParamInfo<gpu::Api>& dialect) {
  return dialect.param == gpu::Api::OpenGl ? "OpenGl" : "OpenGlEs";
}
INSTANTIATE_TEST_SUITE_P(BothDialects, PatchPlace, testing::Values(gpu::Api::OpenGl, gpu::Api::OpenGlEs),
                         dialectName);

}  // namespace
}  // namespace terrane
