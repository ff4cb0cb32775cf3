#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "random_heights.h"
#include "strip_gpu_decoder.h"
#include "terrane/bake/source.h"
#include "terrane/gpu/context.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {
namespace {

class StripGpu : public testing::Test {
 protected:
  void SetUp() override {
    auto context = gpu::Context::createHeadless();
    ASSERT_TRUE(context.ok()) << context.error().message;
    context_ = std::move(context).value();
    auto decoder = StripGpuDecoder::create(*context_);
    ASSERT_TRUE(decoder.ok()) << decoder.error().message;
    decoder_ = std::make_unique<StripGpuDecoder>(std::move(decoder).value());
  }
  void TearDown() override {
    decoder_.reset();
    context_.reset();
  }

  /// What the GPU makes of the meshes is, word for word, what the CPU makes of them.
  void expectSame(const std::vector<StripMesh>& meshes) {
    std::vector<uint32_t> expected;
    std::vector<uint32_t> vertices;
    for (const StripMesh& mesh : meshes) {
      const auto count = decodeStripMesh(mesh, vertices);
      ASSERT_TRUE(count.ok()) << count.error().message;
      expected.insert(expected.end(), vertices.begin(), vertices.end());
    }
    const Status uploaded = decoder_->upload(*context_, meshes);
    ASSERT_TRUE(uploaded.ok()) << uploaded.error().message;
    decoder_->decode();
    EXPECT_EQ(decoder_->triangleCount() * 3, expected.size());
    EXPECT_TRUE(decoder_->readVertices() == expected);
    EXPECT_TRUE(context_->checkErrors("decoding").ok());
  }

  std::unique_ptr<gpu::Context> context_;
  std::unique_ptr<StripGpuDecoder> decoder_;
};

StripMesh encoded(const std::vector<float>& heights, int side, double bound) {
  auto mesh = encodeStripMesh(heights, side, {bound, 0.0});
  EXPECT_TRUE(mesh.ok()) << mesh.error().message;
  return mesh.ok() ? std::move(mesh).value() : StripMesh{};
}

TEST_F(StripGpu, DecodesThousandsOfSmallTilesAsTheCpuDoes) {
  std::vector<StripMesh> meshes;
  for (unsigned seed = 1; seed <= 2400; ++seed) {
    const int side = (1 << (1 + seed % 6)) + 1;
    const double bound = seed % 11 == 0 ? 100.0 : seed % 2 == 0 ? 0.2 : 3.0;
    meshes.push_back(encoded(randomHeights(side, seed), side, bound));
  }
  expectSame(meshes);
}

TEST_F(StripGpu, DecodesOneTileAfterTheOther) {
  // Larger, smaller, larger: what is left of the tile before must not show.
  for (const int side : {65, 3, 129, 17, 513, 5}) expectSame({encoded(randomHeights(side, 2), side, 0.5)});
  expectSame({});
}

/// Tiles of a raster as a build reads them, within a bound of a part of the spacing.
std::vector<StripMesh> meshesOf(const std::string& path, double boundSpacings) {
  std::vector<StripMesh> meshes;
  SilentProgress progress;
  SourceOptions options;
  options.inputs = {path};
  auto source = openSource(options, progress);
  EXPECT_TRUE(source.ok()) << source.error().message;
  if (!source.ok()) return meshes;
  const SourcePlan& plan = (*source)->plan();
  auto reader = (*source)->openReader();
  EXPECT_TRUE(reader.ok());
  std::vector<float> heights(kTileSampleCount);
  std::vector<uint16_t> ranks(kTileSampleCount);
  const int level = plan.frame.finestLevel;
  for (int row = 0; int64_t{row} * kTileCells < plan.extentRows; ++row) {
    for (int col = 0; int64_t{col} * kTileCells < plan.extentCols; ++col) {
      const auto any = (*reader)->readTile({level, col, row}, heights, ranks);
      EXPECT_TRUE(any.ok());
      meshes.push_back(encoded(heights, kTileSamples, boundSpacings * plan.frame.spacingX));
    }
  }
  return meshes;
}

TEST_F(StripGpu, DecodesRealTilesAsTheCpuDoes) {
  const std::filesystem::path data = std::filesystem::path(TERRANE_SOURCE_DIR) / ".." / "shared" / "data";
  int seen = 0;
  for (const char* file : {"bigtujunga/bigtujunga.tif", "mt_hood/lf_elev_220_mt_hood_utm.tif",
                           "gabilan_mesa_1m/gabilan.bil", "swellendam/dem_srtm_utm33s.tif"}) {
    if (!std::filesystem::exists(data / file)) continue;
    SCOPED_TRACE(file);
    ++seen;
    for (const double boundSpacings : {0.5, 0.25}) {
      const std::vector<StripMesh> meshes = meshesOf((data / file).string(), boundSpacings);
      EXPECT_FALSE(meshes.empty());
      expectSame(meshes);
    }
  }
  if (seen == 0) std::printf("no real rasters in ../shared/data: the made-up tiles stand alone\n");
}

TEST_F(StripGpu, MoreThanFitsIsAnError) {
  // note: nothing is copied of what does not fit, so that the count alone needs to be large.
  StripMesh mesh = encoded(std::vector<float>(9, 0.0F), 3, 1.0);
  mesh.triangleCount =
      static_cast<uint32_t>(std::min<size_t>(gpu::StorageBuffer::maxBytes() / 12 + 1, 1U << 31));
  EXPECT_FALSE(decoder_->upload(*context_, std::vector<StripMesh>{mesh, mesh}).ok());
  EXPECT_EQ(decoder_->triangleCount(), 0U);
}

TEST(StripGpuContext, EmbeddedOpenGlIsToldThatItCannotCompute) {
  const auto context = gpu::Context::createHeadless({.api = gpu::Api::OpenGlEs});
  ASSERT_TRUE(context.ok()) << context.error().message;
  const auto decoder = StripGpuDecoder::create(**context);
  ASSERT_FALSE(decoder.ok());
  EXPECT_NE(decoder.error().message.find("compute"), std::string::npos) << decoder.error().message;
}

}  // namespace
}  // namespace terrane
