#include <gtest/gtest.h>

#include <unistd.h>
#include <cmath>
#include <filesystem>
#include <random>

#include "function_source.h"
#include "terrane/bake/build.h"
#include "terrane/engine/elevation_query.h"
#include "terrane/measure/fly.h"
#include "terrane/reference/load_reference.h"
#include "terrane/scene/terrain_scene.h"

/// The whole way, without files from outside: heights -> dataset -> resident tiles -> picture, held against
/// the full-resolution surface.
namespace terrane {
namespace {

/// Mountains that a sum of waves makes, rough enough that every level matters.
float mountains(double x, double y) {
  double height = 0.0, size = 400.0;
  for (double wave = 900.0; wave > 30.0; wave *= 0.47, size *= 0.42) {
    height +=
        size * std::sin(x / wave * 6.1 + 1.3 * std::sin(y / wave * 2.7)) * std::cos(y / wave * 5.3 + wave);
  }
  return static_cast<float>(std::abs(height));
}

class PictureJourney : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("terrane_journey_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::unique_ptr<Terrain> build(const Source& source) {
    BuildOptions options;
    options.output = (folder_ / "made.terrane").string();
    options.overwrite = true;
    SilentProgress silent;
    const auto report = buildDataset(source, options, silent);
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    auto terrain = Terrain::open(options.output);
    EXPECT_TRUE(terrain.ok()) << (terrain.ok() ? "" : terrain.error().message);
    return std::move(terrain).value();
  }

  /// Cameras over and in the terrain: high, low, down, level, wide and narrow.
  static Camera randomCamera(std::mt19937& random, Terrain& terrain) {
    const GroundBox box = terrain.groundBox();
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const glm::dvec2 at(box.low.x + unit(random) * (box.high.x - box.low.x),
                        box.low.y + unit(random) * (box.high.y - box.low.y));
    const double above = 15.0 + 3000.0 * std::pow(unit(random), 3.0);
    const glm::dvec2 towards(box.low.x + unit(random) * (box.high.x - box.low.x),
                             box.low.y + unit(random) * (box.high.y - box.low.y));
    ElevationQuery query(terrain.dataset());
    const auto ground = query.heightAt(at);
    const double height = ground.ok() && *ground ? **ground : box.high.z;
    return lookAt({at.x, at.y, height + above}, {towards.x, towards.y, 200.0 * unit(random)},
                  0.5 + unit(random), 320, 180);
  }

  /// The measured error is within tau (or the dataset's own bound), and no pixel shows through, whatever is
  /// resident.
  void expectTruePictures(Terrain& terrain, uint32_t seed, const std::vector<int>& ks) {
    auto loaded = loadReference(terrain.dataset());
    ASSERT_TRUE(loaded.ok()) << loaded.error().message;
    const ReferenceSurface surface(std::move(loaded).value());
    const ReferenceSurface::Cover cover(surface, coarsestCellMargin(terrain.dataset().manifest().frame));
    std::mt19937 random(seed);
    for (const int k : ks) {
      PatchSelection selection;
      selection.grid.k = k;
      TerrainScene scene(terrain, selection);
      for (int i = 0; i < 4; ++i) {
        const Camera camera = randomCamera(random, terrain);
        ASSERT_TRUE(scene.loadAll(camera).ok());
        const auto places = scene.places(camera);
        ASSERT_TRUE(places.ok()) << places.error().message;
        // Nothing in view claims more, down to where no finer tile is stored.
        const Cut cut = terrain.select(camera, selection);
        EXPECT_TRUE(cut.wishes.empty());
        const Lattice lattice(cut.latticeDepth);
        for (const Patch& patch : cut.patches) {
          const int below = selection.grid.tileLevel(patch.triangle.diamond.level + 1);
          const bool finest = below > lattice.depth() ||
                              terrain.tiles().find(lattice.tileOf(patch.triangle, below)) == nullptr;
          if (!finest) {
            ASSERT_LE(patch.errorPixels, 1.0F) << "K " << selection.grid.samplesPerSide();
          }
        }
        const ErrorMeasure error = measureError(surface, camera, *places, 1.0);
        EXPECT_LE(error.maxPixels, 1.0) << "K " << selection.grid.samplesPerSide() << " camera " << i;
        EXPECT_EQ(measureCracks(surface, camera, *places, 1.0).cracks, 0);
      }
      Camera above = overviewCamera(terrain.groundBox(), 200.0, 60.0, 0.9, 320, 180);
      int64_t pictures = 0;
      const auto loading = measureLoading(scene, above, cover, 4, seed, pictures);
      ASSERT_TRUE(loading.ok()) << loading.error().message;
      EXPECT_EQ(loading->cracks, 0);
      EXPECT_GT(pictures, 0);
    }
  }

  std::filesystem::path folder_;
};

TEST_F(PictureJourney, KeepsItsErrorAndHasNoCracks) {
  const FunctionSource source(
      {{2, 0, 0, 900, 700, [](int64_t x, int64_t y) { return mountains(double(x), double(y)); }}}, 0.1, 0.05);
  const auto terrain = build(source);
  expectTruePictures(*terrain, 1, {3, 4, 5, 7});
}

TEST_F(PictureJourney, HolesAndRaggedEdgesChangeNothing) {
  const float none = std::numeric_limits<float>::quiet_NaN();
  const FunctionSource source({{2, 0, 0, 800, 800,
                                [none](int64_t x, int64_t y) {
                                  const double dx = double(x) - 400.0, dy = double(y) - 420.0;
                                  const bool outside =
                                      std::hypot(dx, dy) > 340.0 + 30.0 * std::sin(std::atan2(dy, dx) * 9.0);
                                  const bool hole = std::hypot(dx + 100.0, dy - 60.0) < 45.0;
                                  return outside || hole ? none : mountains(double(x), double(y));
                                }}},
                              1.0, 0.0);
  const auto terrain = build(source);
  expectTruePictures(*terrain, 2, {2, 3, 4, 6});
}

TEST_F(PictureJourney, AFineVillageInACoarseCountryFits) {
  // One sample in eight over the country, every one over the village; nothing is stored elsewhere.
  const FunctionSource source(
      {{1, 0, 0, 300, 300, [](int64_t x, int64_t y) { return mountains(double(x) * 4.0, double(y) * 4.0); }},
       {4, 1000, 1300, 1300, 1500,
        [](int64_t x, int64_t y) {
          return mountains(double(x) / 2.0, double(y) / 2.0) +
                 static_cast<float>(20.0 * std::sin(double(x) * 0.3));
        }}},
      0.1, 0.05);
  const auto terrain = build(source);
  // The village covers 2 x 2 tiles of level 4 at most, with their neighbours and ancestors.
  EXPECT_LT(terrain->dataset().manifest().tileCount, 70u);
  expectTruePictures(*terrain, 3, {4, 5});
}

TEST_F(PictureJourney, QueriesAgreeWithTheReference) {
  const FunctionSource source(
      {{2, 0, 0, 600, 900, [](int64_t x, int64_t y) { return mountains(double(x), double(y)); }}}, 1.0, 0.0);
  const auto terrain = build(source);
  auto loaded = loadReference(terrain->dataset());
  ASSERT_TRUE(loaded.ok());
  ElevationQuery query(terrain->dataset());
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-0.1, 1.1);
  const GroundBox box = terrain->groundBox();
  int ground = 0;
  for (int i = 0; i < 5000; ++i) {
    const glm::dvec2 at(unit(random) * box.high.x, unit(random) * box.low.y);
    const auto answer = query.heightAt(at);
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    const auto truth = loaded->heightAt(at);
    ASSERT_EQ(answer->has_value(), truth.has_value()) << at.x << " " << at.y;
    if (!truth) continue;
    EXPECT_NEAR(**answer, *truth, 1e-6);
    ++ground;
  }
  EXPECT_GT(ground, 3000);
}

}  // namespace
}  // namespace terrane
