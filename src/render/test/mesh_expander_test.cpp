#include "mesh_expander.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>

#include "random_mesh_levels.h"
#include "temporary_directory.h"
#include "terrane/bake/build.h"
#include "terrane/bake/source.h"
#include "terrane/codec/all_layers.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/dataset.h"
#include "terrane/gpu/context.h"

namespace terrane {
namespace {

class MeshExpanderTest : public testing::Test {
 protected:
  void expectSameOf(const std::string& raster, unsigned& turn);
  void SetUp() override {
    auto context = gpu::Context::createHeadless();
    ASSERT_TRUE(context.ok()) << context.error().message;
    context_ = std::move(context).value();
    auto expander = MeshExpander::create(*context_);
    ASSERT_TRUE(expander.ok()) << expander.error().message;
    expander_ = std::make_unique<MeshExpander>(std::move(expander).value());
    vertices_ = std::make_unique<gpu::StorageBuffer>();
    indices_ = std::make_unique<gpu::StorageBuffer>();
  }
  void TearDown() override {
    vertices_.reset();
    indices_.reset();
    expander_.reset();
    context_.reset();
  }

  /// What the GPU makes of the levels' compact forms is, word for word, what their meshes are: wherever it
  /// goes, in whatever order, and nothing is written anywhere else.
  void expectSame(const std::vector<MeshLevel>& levels, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<CompactLevel> compact;
    std::vector<MeshExpander::Job> jobs;
    for (const MeshLevel& level : levels) compact.push_back(compactOf(level));
    for (const CompactLevel& level : compact)
      for (int i = 0; i < patchCount(level.level()); ++i)
        jobs.push_back(
            {.level = &level, .patch = i, .slot = static_cast<uint32_t>(random()) % MeshExpander::kSlots});
    patches_ += jobs.size();
    std::shuffle(jobs.begin(), jobs.end(), random);
    uint32_t vertexCount = 0, indexCount = 0;
    for (MeshExpander::Job& job : jobs) {
      const CompactPatch patch = compactPatch(*job.level, job.patch);
      job.firstVertex = vertexCount += static_cast<uint32_t>(random() % 3);
      job.firstIndex = indexCount += static_cast<uint32_t>(random() % 3);
      vertexCount += patch.vertexCount;
      indexCount += 3 * patch.triangleCount;
    }
    std::shuffle(jobs.begin(), jobs.end(), random);

    constexpr uint32_t kUntouched = 0xdeadbeef;
    std::vector<uint32_t> vertices(size_t{3} * (vertexCount + 1), kUntouched);
    std::vector<uint32_t> indices(size_t{indexCount} + 1, kUntouched);
    vertices_->upload(vertices.data(), vertices.size() * sizeof(uint32_t));
    indices_->upload(indices.data(), indices.size() * sizeof(uint32_t));
    const Status expanded = expander_->expand(*context_, jobs, vertices_->name(), indices_->name());
    ASSERT_TRUE(expanded.ok()) << expanded.error().message;

    for (const MeshExpander::Job& job : jobs) {
      const MeshLevel& level = levels[static_cast<size_t>(job.level - compact.data())];
      const MeshLevel::Patch& patch = level.patches[static_cast<size_t>(job.patch)];
      uint32_t* target = &vertices[size_t{3} * job.firstVertex];
      for (uint32_t i = 0; i < patch.vertexCount; ++i, target += 3) {
        PatchVertex vertex = level.vertices[patch.firstVertex + i];
        vertex.place |= job.slot << 18;
        std::memcpy(target, &vertex, sizeof(vertex));
      }
      for (uint32_t i = 0; i < patch.indexCount; ++i)
        indices[job.firstIndex + i] = job.firstVertex + level.indices[patch.firstIndex + i];
    }
    std::vector<uint32_t> read(vertices.size());
    vertices_->read(read.data(), read.size() * sizeof(uint32_t));
    EXPECT_TRUE(read == vertices);
    read.resize(indices.size());
    indices_->read(read.data(), read.size() * sizeof(uint32_t));
    EXPECT_TRUE(read == indices);
  }

  std::unique_ptr<gpu::Context> context_;
  std::unique_ptr<MeshExpander> expander_;
  std::unique_ptr<gpu::StorageBuffer> vertices_;
  std::unique_ptr<gpu::StorageBuffer> indices_;
  size_t patches_ = 0;
};

TEST_F(MeshExpanderTest, ExpandsRandomMeshesOfAllLevelsAsTheCpuDoes) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE(seed);
    std::vector<MeshLevel> levels;
    RandomMeshes options = randomMeshesOf(seed);
    options.lastKept = 10;
    visitRandomMeshes(seed, options, [&](const MeshLevel& meshes) { levels.push_back(meshes); });
    expectSame(levels, seed);
  }
}

TEST_F(MeshExpanderTest, ExpandsAMillionSmallPatchesAsTheCpuDoes) {
  // More work groups than go in one direction.
  for (unsigned seed = 40; patches_ < 1'000'000; ++seed) {
    SCOPED_TRACE(seed);
    std::vector<MeshLevel> levels;
    RandomMeshes options = randomMeshesOf(seed);
    options.firstKept = 11;
    visitRandomMeshes(seed, options, [&](const MeshLevel& meshes) { levels.push_back(meshes); });
    expectSame(levels, seed);
  }
}

/// All tiles of a raster, as a dataset has them, parents first.
std::map<TileId, Tile> tilesOf(const std::string& raster, Manifest& manifest) {
  std::map<TileId, Tile> out;
  const TemporaryDirectory folder;
  SilentProgress progress;
  SourceOptions options;
  options.inputs = {raster};
  auto source = openSource(options, progress);
  EXPECT_TRUE(source.ok()) << source.error().message;
  if (!source.ok()) return out;
  BuildOptions building;
  building.output = folder.file("made.terrane");
  const auto built = buildDataset(**source, building, progress);
  EXPECT_TRUE(built.ok()) << built.error().message;
  const auto dataset = Dataset::open(building.output);
  EXPECT_TRUE(dataset.ok()) << dataset.error().message;
  if (!dataset.ok()) return out;
  manifest = dataset->manifest();
  std::vector<TileId> ids = dataset->elevationTiles();
  std::sort(ids.begin(), ids.end());
  for (const TileId id : ids) {
    const auto payloads = dataset->readAllLayers(id);
    EXPECT_TRUE(payloads.ok() && payloads->has_value());
    const TileSamples* parent = id.isRoot() ? nullptr : &out.at(id.parent()).samples;
    auto tile = decodeAllLayers(**payloads, parent, id.isRoot() ? 0 : id.quadrant(), manifest.scale);
    EXPECT_TRUE(tile.ok()) << tile.error().message;
    out[id] = std::move(tile).value();
  }
  return out;
}

/// All tiles of a raster, the very deepest level of the first; `turn` counts tiles.
void MeshExpanderTest::expectSameOf(const std::string& raster, unsigned& turn) {
  Manifest manifest;
  const std::map<TileId, Tile> tiles = tilesOf(raster, manifest);
  ASSERT_FALSE(tiles.empty());
  const MeshScale meshScale = MeshScale::of(manifest.frame, manifest.scale);
  std::map<TileId, MeshLevel> lastOwn;
  for (const auto& [id, tile] : tiles) {
    SCOPED_TRACE(toString(id));
    // To the level that all samples count on; of one tile to the very deepest.
    const bool isFinest = id.level == manifest.frame.finestLevel;
    const int last = turn == 0  ? kDeepestVertexLevel
                     : isFinest ? meshScale.deepestLevel() - 2 * id.level
                                : meshScale.lastOwnLevel();
    std::vector<MeshLevel> levels;
    const MeshLevel* before = id.isRoot() ? nullptr : &lastOwn.at(id.parent());
    levels.reserve(kDeepestVertexLevel + 1);
    for (int level = meshScale.firstLevel(id.isRoot()); level <= last; ++level) {
      levels.push_back(makeMeshLevel(id, tile, level, before, meshScale, manifest.scale));
      before = &levels.back();
      if (level == meshScale.lastOwnLevel()) lastOwn[id] = levels.back();
    }
    expectSame(levels, ++turn);
  }
}

TEST_F(MeshExpanderTest, ExpandsRealTilesAsTheCpuDoes) {
  const std::filesystem::path data = std::filesystem::path(TERRANE_SOURCE_DIR) / ".." / "shared" / "data";
  unsigned turn = 0;
  for (const char* name :
       {"bigtujunga/bigtujunga.tif", "mt_hood/lf_elev_220_mt_hood_utm.tif", "zion/dem_srtm_zion.tif",
        "swellendam/dem_srtm_utm33s.tif", "gabilan_mesa_1m/gabilan.bil", "swiss_alps_n46e008/N46E008.tif",
        "new_zealand_1km/nz_elev.tif"}) {
    SCOPED_TRACE(name);
    if (std::filesystem::exists(data / name)) expectSameOf((data / name).string(), turn);
  }
  if (turn == 0) {
    std::printf("no real rasters in ../shared/data: the made-up tiles stand alone\n");
  } else {
    EXPECT_GT(patches_, 100'000U);
  }
}

TEST_F(MeshExpanderTest, WhatDoesNotFitIsAnError) {
  std::vector<CompactLevel> levels;
  RandomMeshes options = randomMeshesOf(1);
  options.lastKept = 2;
  visitRandomMeshes(1, options, [&](const MeshLevel& meshes) { levels.push_back(compactOf(meshes)); });
  const CompactPatch patch = compactPatch(levels[0], 0);
  const auto expand = [&](size_t vertices, size_t indices, MeshExpander::Job job) {
    // note: storage is kept while it suffices, so that a smaller one must be another buffer.
    vertices_ = std::make_unique<gpu::StorageBuffer>();
    indices_ = std::make_unique<gpu::StorageBuffer>();
    vertices_->upload(nullptr, vertices * sizeof(PatchVertex));
    indices_->upload(nullptr, indices * sizeof(uint32_t));
    job.level = levels.data();
    return expander_->expand(*context_, std::span(&job, 1), vertices_->name(), indices_->name()).ok();
  };
  const size_t vertices = patch.vertexCount, indices = size_t{3} * patch.triangleCount;
  EXPECT_TRUE(expand(vertices, indices, {}));
  EXPECT_TRUE(expand(vertices + 5, indices + 7, {.firstVertex = 5, .firstIndex = 7, .slot = 16383}));
  EXPECT_FALSE(expand(vertices - 1, indices, {}));
  EXPECT_FALSE(expand(vertices, indices - 1, {}));
  EXPECT_FALSE(expand(vertices, indices, {.firstVertex = 1}));
  EXPECT_FALSE(expand(vertices, indices, {.firstIndex = 1}));
  EXPECT_FALSE(expand(vertices, indices, {.firstVertex = 0xffffffff, .firstIndex = 0xffffffff}));
  EXPECT_FALSE(expand(vertices, indices, {.slot = 16384}));
  EXPECT_TRUE(expander_->expand(*context_, {}, vertices_->name(), indices_->name()).ok());
}

TEST(MeshExpanderContext, EmbeddedOpenGlIsToldThatItCannotCompute) {
  const auto context = gpu::Context::createHeadless({.api = gpu::Api::OpenGlEs});
  ASSERT_TRUE(context.ok()) << context.error().message;
  const auto expander = MeshExpander::create(**context);
  ASSERT_FALSE(expander.ok());
  EXPECT_NE(expander.error().message.find("compute"), std::string::npos) << expander.error().message;
}

}  // namespace
}  // namespace terrane
