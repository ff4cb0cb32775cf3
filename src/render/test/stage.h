#pragma once

#include <memory>
#include <utility>

#include "made_up_world.h"
#include "terrane/base/check.h"
#include "terrane/render/terrain_renderer.h"

namespace terrane {

/// A context with a renderer.
struct Stage {
  std::unique_ptr<gpu::Context> context;
  std::unique_ptr<TerrainRenderer> renderer;

  explicit Stage(const gpu::ContextOptions& options = {}) {
    auto made = gpu::Context::createHeadless(options);
    TERRANE_CHECK(made.ok(), "{}", made.error().message);
    context = std::move(made).value();
    auto drawing = TerrainRenderer::create(*context);
    TERRANE_CHECK(drawing.ok(), "{}", drawing.error().message);
    renderer = std::move(drawing).value();
  }

  void uploadAll(const MadeUpWorld& world, int deepestLevel) const {
    for (int level = 0; level <= deepestLevel; ++level)
      for (int row = 0; row < 1 << level; ++row)
        for (int col = 0; col < 1 << level; ++col) {
          const Status uploaded = renderer->uploadTile({level, col, row}, world.tile({level, col, row}));
          TERRANE_CHECK(uploaded.ok(), "{}", uploaded.error().message);
        }
  }
};

}  // namespace terrane
