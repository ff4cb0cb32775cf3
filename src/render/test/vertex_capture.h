#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <vector>

#include "frame_block.h"
#include "made_up_world.h"
#include "patch_drawer.h"
#include "shader_library.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/framebuffer.h"
#include "terrane/tiling/patch_template.h"

namespace terrane {

/// What the vertex stage made of one vertex of one patch.
struct CapturedVertex {
  std::array<float, 4> clip;
  std::array<float, 3> place;
  float height;
};
static_assert(sizeof(CapturedVertex) == 32);

/// Runs a cut through the vertex stage that draws the ground.
class VertexCapture {
 public:
  explicit VertexCapture(gpu::Context& context)
      : context_(context),
        program_(makeProgram(context, ProgramRecipes().shade, {"gl_Position", "vPlace", "vHeight"})),
        // note: without a framebuffer nothing is drawn, even where nothing is rasterised.
        target_(gpu::Framebuffer::create(context, {.width = 4, .height = 4})) {
    TERRANE_CHECK(program_.ok(), "{}", program_.error().message);
    TERRANE_CHECK(target_.ok(), "{}", target_.error().message);
    TileStore::setSamplers(*program_);
  }

  /// A vertex as the captured numbers belong to it.
  struct Vertex {
    LatticePoint at;
    int which = 0;  ///< template
    CapturedVertex captured;
  };

  std::vector<Vertex> run(const Cut& cut, const Frame& frame, const TileStore& tiles, const Camera& camera,
                          double exaggeration) {
    const Lattice lattice(cut.latticeDepth);
    RenderStyle style;
    style.exaggeration = exaggeration;
    const LatticePoint anchor = anchorNear(lattice, frame, camera.eyeLocal);
    const auto instances = makePatchInstances(cut, frame, anchor, tiles);
    TERRANE_CHECK(instances.ok(), "{}", instances.error().message);
    FrameBlock block = makeFrameBlock(frame, camera, style, chooseDepthRange(context_, frame, camera), 1);
    placeLattice(block, frame, camera, exaggeration, cut.latticeDepth, anchor, cut.grid.cellsPerSide());
    drawer_.setInstances(cut.grid, *instances);
    target_->bind();
    tiles.bind();
    uniforms_.upload(&block, sizeof(block));
    glBindBufferBase(GL_UNIFORM_BUFFER, kFrameBinding, uniforms_.name());

    std::vector<Vertex> out;
    for (int which = 0; which < 2; ++which) {
      const auto& group = instances->byTemplate[static_cast<size_t>(which)];
      const auto vertices =
          (which == 0 ? makeRightAngleTemplate(cut.grid) : makeHypotenuseTemplate(cut.grid)).vertices;
      const std::vector<CapturedVertex> captured = draw(which, group.size() * vertices.size());
      for (size_t i = 0; i < captured.size(); ++i) {
        const PatchInstance& instance = group[i / vertices.size()];
        const LatticePoint turned = rotateQuarters(vertices[i % vertices.size()], instance.lattice[3]);
        out.push_back({{instance.lattice[0] + anchor.x + turned.x * instance.lattice[2],
                        instance.lattice[1] + anchor.y + turned.y * instance.lattice[2]},
                       which,
                       captured[i]});
      }
    }
    return out;
  }

 private:
  std::vector<CapturedVertex> draw(int which, size_t count) {
    std::vector<CapturedVertex> out(count);
    if (count == 0) return out;
    feedback_.upload(nullptr, count * sizeof(CapturedVertex));
    program_->use();
    glEnable(GL_RASTERIZER_DISCARD);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, feedback_.name());
    program_->setInt("uTemplate", which);
    glBeginTransformFeedback(GL_POINTS);
    EXPECT_EQ(drawer_.drawPoints(which), static_cast<int64_t>(count));
    glEndTransformFeedback();
    glDisable(GL_RASTERIZER_DISCARD);
    feedback_.bind();
    const auto bytes = static_cast<GLsizeiptr>(count * sizeof(CapturedVertex));
    const void* mapped = glMapBufferRange(GL_TRANSFORM_FEEDBACK_BUFFER, 0, bytes, GL_MAP_READ_BIT);
    TERRANE_CHECK(mapped != nullptr, "captured vertices cannot be read");
    std::memcpy(out.data(), mapped, count * sizeof(CapturedVertex));
    glUnmapBuffer(GL_TRANSFORM_FEEDBACK_BUFFER);
    return out;
  }

  gpu::Context& context_;
  Result<gpu::Program> program_;
  Result<gpu::Framebuffer> target_;
  PatchDrawer drawer_;
  gpu::Buffer uniforms_{GL_UNIFORM_BUFFER};
  gpu::Buffer feedback_{GL_TRANSFORM_FEEDBACK_BUFFER};
};

/// Puts every tile of a made-up world into a store.
inline void uploadAllTiles(const MadeUpWorld& world, TileStore& tiles) {
  for (int level = 0; level <= world.frame.finestLevel; ++level) {
    for (int row = 0; row < 1 << level; ++row) {
      for (int col = 0; col < 1 << level; ++col) {
        const TileId id{level, col, row};
        const Tile tile = world.tile(id);
        const Status uploaded = tiles.upload(id, tile.samples, *prepareTile(tile.samples));
        TERRANE_CHECK(uploaded.ok(), "{}", uploaded.error().message);
      }
    }
  }
}

}  // namespace terrane
