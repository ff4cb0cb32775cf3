#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "made_up_world.h"
#include "terrane/base/check.h"
#include "terrane/render/png.h"
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

/// What a suite of tests with both dialects of GLSL is called with this one.
inline std::string dialectName(const testing::TestParamInfo<gpu::Api>& dialect) {
  return dialect.param == gpu::Api::OpenGl ? "OpenGl" : "OpenGlEs";
}

/// For a person to look at, where TERRANE_LOOK names a folder.
inline void look(const std::string& name, const std::vector<uint8_t>& rgba, int width, int height) {
  if (const char* folder = std::getenv("TERRANE_LOOK")) {
    EXPECT_TRUE(writePng(std::string(folder) + "/" + name + ".png", width, height, rgba).ok());
  }
}

}  // namespace terrane
