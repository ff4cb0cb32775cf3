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

/// Of 255, on average; and the share of pixels that may differ by a tenth.
constexpr double kMeanDifference = 0.7;
constexpr double kOtherShare = 0.005;

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

  static std::vector<PatchSelection> patches(const std::vector<int>& ks) {
    std::vector<PatchSelection> out(ks.size());
    for (size_t i = 0; i < ks.size(); ++i) out[i].grid.k = ks[i];
    return out;
  }
  static std::vector<PatchSelection> meshes() {
    PatchSelection out;
    out.surface = SurfaceKind::Meshes;
    return {out};
  }
  static std::string nameOf(const PatchSelection& selection) {
    return selection.surface == SurfaceKind::Meshes ? "meshes"
                                                    : fmt::format("K {}", selection.grid.samplesPerSide());
  }

  /// Nothing is left to wish for; and of patches none in view claims more than tau, down to where no finer
  /// tile is stored.
  static void expectFineEnough(Terrain& terrain, const Cut& cut, const PatchSelection& selection) {
    EXPECT_TRUE(cut.wishes.empty());
    EXPECT_TRUE(cut.meshWishes.empty());
    if (selection.surface == SurfaceKind::Meshes) return;
    const Lattice lattice(cut.latticeDepth);
    for (const Patch& patch : cut.patches) {
      const int below = selection.grid.tileLevel(patch.triangle.diamond.level + 1);
      const bool finest =
          below > lattice.depth() || terrain.tiles().find(lattice.tileOf(patch.triangle, below)) == nullptr;
      if (!finest) {
        ASSERT_LE(patch.errorPixels, 1.0F) << nameOf(selection);
      }
    }
  }

  /// The measured error is within tau (or the dataset's own bound), and no pixel shows through, whatever is
  /// resident.
  void expectTruePictures(Terrain& terrain, uint32_t seed, const std::vector<PatchSelection>& selections) {
    auto loaded = loadReference(terrain.dataset());
    ASSERT_TRUE(loaded.ok()) << loaded.error().message;
    const ReferenceSurface surface(std::move(loaded).value());
    const ReferenceSurface::Cover cover(surface, coarsestCellMargin(terrain.dataset().manifest().frame));
    std::mt19937 random(seed);
    for (const PatchSelection& selection : selections) {
      TerrainScene scene(terrain, selection);
      for (int i = 0; i < 4; ++i) {
        const Camera camera = randomCamera(random, terrain);
        ASSERT_TRUE(scene.loadAll(camera).ok());
        const auto places = scene.places(camera);
        ASSERT_TRUE(places.ok()) << places.error().message;
        expectFineEnough(terrain, terrain.select(camera, selection), selection);
        const ErrorMeasure error = measureError(surface, camera, *places, 1.0);
        EXPECT_LE(error.maxPixels, 1.0) << nameOf(selection) << ", camera " << i;
        EXPECT_EQ(measureCracks(surface, camera, *places, 1.0).cracks, 0) << nameOf(selection);
      }
      Camera above = overviewCamera(terrain.groundBox(), 200.0, 60.0, 0.9, 320, 180);
      int64_t pictures = 0;
      const auto loading = measureLoading(scene, above, cover, 4, seed, pictures);
      ASSERT_TRUE(loading.ok()) << loading.error().message;
      EXPECT_EQ(loading->cracks, 0) << nameOf(selection);
      EXPECT_GT(pictures, 0);
    }
  }

  /// Both surfaces' pictures: the same sky but for an outline, and the same ground but for what tau allows.
  static void expectSamePictures(Terrain& terrain, const Camera& camera) {
    std::vector<Picture> drawn;
    for (const PatchSelection& selection : {patches({4}).front(), meshes().front()}) {
      const auto cut = terrain.selectAndLoad(camera, selection);
      ASSERT_TRUE(cut.ok()) << cut.error().message;
      auto picture = terrain.draw(*cut, camera, RenderStyle{});
      ASSERT_TRUE(picture.ok()) << picture.error().message;
      drawn.push_back(std::move(picture).value());
    }
    ASSERT_EQ(drawn[0].rgba.size(), drawn[1].rgba.size());
    double sum = 0.0;
    int64_t other = 0;
    for (size_t i = 0; i < drawn[0].rgba.size(); i += 4) {
      int most = 0;
      for (size_t c = i; c < i + 3; ++c) most = std::max(most, std::abs(drawn[0].rgba[c] - drawn[1].rgba[c]));
      sum += most;
      other += most > 24 ? 1 : 0;
    }
    const double pixels = static_cast<double>(camera.width) * camera.height;
    EXPECT_LT(sum / pixels, kMeanDifference);
    EXPECT_LT(static_cast<double>(other), kOtherShare * pixels);
  }

  std::filesystem::path folder_;
};

TEST_F(PictureJourney, KeepsItsErrorAndHasNoCracks) {
  const FunctionSource source(
      {{2, 0, 0, 900, 700, [](int64_t x, int64_t y) { return mountains(double(x), double(y)); }}}, 0.1, 0.05);
  const auto terrain = build(source);
  expectTruePictures(*terrain, 1, patches({3, 4, 5, 7}));
  expectTruePictures(*terrain, 5, meshes());
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
  expectTruePictures(*terrain, 2, patches({2, 3, 4, 6}));
  expectTruePictures(*terrain, 6, meshes());
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
  expectTruePictures(*terrain, 3, patches({4, 5}));
  expectTruePictures(*terrain, 7, meshes());
}

TEST_F(PictureJourney, MeshesShowWhatPatchesShow) {
  const FunctionSource source(
      {{2, 0, 0, 900, 700, [](int64_t x, int64_t y) { return mountains(double(x), double(y)); }}}, 0.1, 0.05);
  const auto terrain = build(source);
  expectSamePictures(*terrain, overviewCamera(terrain->groundBox(), 200.0, 35.0, 0.9, 320, 180));
  std::mt19937 random(8);
  for (int i = 0; i < 4; ++i) expectSamePictures(*terrain, randomCamera(random, *terrain));
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
