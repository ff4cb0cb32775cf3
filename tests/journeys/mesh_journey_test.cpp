#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "function_source.h"
#include "program.h"
#include "temporary_directory.h"
#include "terrane/bake/build.h"
#include "terrane/engine/elevation_query.h"
#include "terrane/lod/mesh_placement.h"
#include "terrane/measure/drawn_surface.h"
#include "terrane/measure/fly.h"
#include "terrane/measure/mesh_seams.h"
#include "terrane/reference/load_reference.h"
#include "terrane/scene/terrain_scene.h"

/// Meshes all the way: datasets -> tiles that arrive in any order -> cuts whose meshes meet exactly, and keep
/// to their error.
namespace terrane {
namespace {

class MeshJourney : public ::testing::Test {
 protected:
  std::unique_ptr<Terrain> build(const Source& source) {
    BuildOptions options;
    options.output = folder_.file("made.terrane");
    options.overwrite = true;
    SilentProgress silent;
    const auto report = buildDataset(source, options, silent);
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return open(options.output);
  }
  static std::unique_ptr<Terrain> open(const std::string& path) {
    auto terrain = Terrain::open(path);
    EXPECT_TRUE(terrain.ok()) << (terrain.ok() ? "" : terrain.error().message);
    return std::move(terrain).value();
  }

  static Camera randomCamera(std::mt19937& random, Terrain& terrain) {
    const GroundBox box = terrain.groundBox();
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const auto place = [&] {
      return glm::dvec2(box.low.x + unit(random) * (box.high.x - box.low.x),
                        box.low.y + unit(random) * (box.high.y - box.low.y));
    };
    const glm::dvec2 at = place(), towards = place();
    ElevationQuery query(terrain.dataset());
    const auto ground = query.heightAt(at);
    const double height = ground.ok() && *ground ? **ground : box.high.z;
    const double above = 5.0 + 0.1 * (box.high.x - box.low.x) * std::pow(unit(random), 3.0);
    return lookAt({at.x, at.y, height + above}, {towards.x, towards.y, height}, 0.5 + unit(random), 320, 180);
  }

  /// Tiles and meshes come one by one, in a random order; whatever is there, patches meet bit for bit. Also
  /// while they fade in.
  static void expectNoGaps(Terrain& terrain, uint32_t seed, int views) {
    const Manifest& manifest = terrain.dataset().manifest();
    std::mt19937 random(seed);
    int64_t sides = 0, cuts = 0;
    for (int view = 0; view < views; ++view) {
      TilePool pool(terrain.dataset());
      const Camera camera = randomCamera(random, terrain);
      PatchSelection selection;
      selection.surface = SurfaceKind::Meshes;
      selection.cull = view % 2 == 0;
      selection.tolerancePixels = view % 3 == 0 ? 2.0 / 3.0 : 1.5;
      MorphHistory history;
      for (int step = 0;; ++step) {
        const Cut cut =
            selectPatches(selection, manifest.frame, manifest.scale, camera, pool, &history, 0.05);
        const MeshSeams seams = measureMeshSeams(cut, pool);
        ASSERT_EQ(seams.gaping, 0) << "view " << view << ", step " << step;
        ASSERT_EQ(seams.unlike, 0) << "view " << view << ", step " << step;
        sides += seams.sides;
        ++cuts;
        if (cut.wishes.empty() && cut.meshWishes.empty() && cut.ramping == 0) break;
        // One or a few of what is wished for.
        if (!cut.wishes.empty() && (cut.meshWishes.empty() || random() % 2 == 0)) {
          std::vector<TileId> ids;
          for (const TileWish& wish : cut.wishes)
            if (random() % 3 == 0) ids.push_back(wish.tile);
          ASSERT_TRUE(pool.load(ids).ok());
        }
        std::vector<MeshWish> made;
        for (const MeshWish& wish : cut.meshWishes)
          if (random() % 2 == 0) made.push_back(wish);
        pool.makeMeshes(made);
      }
    }
    EXPECT_GT(sides, 100);
    std::printf("%lld sides of patches met in %lld cuts\n", static_cast<long long>(sides),
                static_cast<long long>(cuts));
  }

  /// Of what nearer meshes hide nothing is seen: between the eye and any place of it there is ground that is
  /// drawn, or it lies outside the picture.
  static void expectHiddenIsHidden(Terrain& terrain, uint32_t seed, int views, int64_t leastPatches) {
    const Frame& frame = terrain.dataset().manifest().frame;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    PatchSelection selection;
    selection.surface = SurfaceKind::Meshes;
    int64_t patches = 0, places = 0;
    for (int view = 0; view < views; ++view) {
      const Camera camera = randomCamera(random, terrain);
      const auto loaded = terrain.selectAndLoad(camera, selection);
      ASSERT_TRUE(loaded.ok()) << loaded.error().message;
      const Cut& cut = *loaded;
      const DrawnSurface drawn(cut, frame, terrain.tiles());
      Cut behind = cut;
      behind.patches = cut.hidden;
      const DrawnSurface hidden(behind, frame, terrain.tiles());
      const Lattice lattice(cut.latticeDepth);
      const glm::dvec2 cell(frame.spacingXMeters(), -frame.spacingYMeters());
      for (const Patch& patch : cut.hidden) {
        ++patches;
        const auto ends = lattice.hypotenuse(patch.triangle.diamond);
        const double a = unit(random), b = unit(random) * (1.0 - a), c = 1.0 - a - b;
        const glm::dvec2 place =
            cell * (a * glm::dvec2(ends[0].x, ends[0].y) + b * glm::dvec2(ends[1].x, ends[1].y) +
                    c * glm::dvec2(patch.triangle.apex.x, patch.triangle.apex.y));
        const auto height = hidden.heightAt(place);
        if (!height) continue;
        const glm::dvec3 target(place, *height);
        const glm::dvec3 seen = camera.viewFromLocal(target);
        if (seen.z <= 0.0 || std::abs(seen.x) > seen.z * camera.tanHalfX() ||
            std::abs(seen.y) > seen.z * camera.tanHalfY())
          continue;
        ++places;
        const auto steps =
            static_cast<int>(8.0 * glm::length(place - glm::dvec2(camera.eyeLocal)) / cell.x) + 1;
        bool isHidden = false;
        for (int i = 1; i < steps && !isHidden; ++i) {
          const glm::dvec3 at =
              camera.eyeLocal + (target - camera.eyeLocal) * (static_cast<double>(i) / steps);
          const auto ground = drawn.heightAt(glm::dvec2(at));
          isHidden = ground && *ground >= at.z;
        }
        ASSERT_TRUE(isHidden) << "view " << view << ", at " << place.x << " " << place.y;
      }
    }
    EXPECT_GT(patches, leastPatches);
    std::printf("%lld patches hidden, %lld places looked at\n", static_cast<long long>(patches),
                static_cast<long long>(places));
  }

  /// The drawn picture keeps to tau, and nothing shows through, resident or while loading.
  static void expectTruePictures(Terrain& terrain, uint32_t seed) {
    auto loaded = loadReference(terrain.dataset());
    ASSERT_TRUE(loaded.ok()) << loaded.error().message;
    const ReferenceSurface surface(std::move(loaded).value());
    const ReferenceSurface::Cover cover(surface, coarsestCellMargin(terrain.dataset().manifest().frame));
    std::mt19937 random(seed);
    for (const double tau : {2.0 / 3.0, 1.0}) {
      PatchSelection selection;
      selection.surface = SurfaceKind::Meshes;
      selection.tolerancePixels = tau;
      TerrainScene scene(terrain, selection);
      for (int i = 0; i < 4; ++i) {
        const Camera camera = randomCamera(random, terrain);
        ASSERT_TRUE(scene.loadAll(camera).ok());
        const auto places = scene.places(camera);
        ASSERT_TRUE(places.ok()) << places.error().message;
        const ErrorMeasure error = measureError(surface, camera, *places, tau);
        EXPECT_LE(error.maxPixels, tau) << "camera " << i;
        EXPECT_EQ(measureCracks(surface, camera, *places, tau).cracks, 0);
      }
      const Camera above = overviewCamera(terrain.groundBox(), 200.0, 60.0, 0.9, 320, 180);
      int64_t pictures = 0;
      const auto loading = measureLoading(scene, above, cover, 4, seed, pictures);
      ASSERT_TRUE(loading.ok()) << loading.error().message;
      EXPECT_EQ(loading->cracks, 0);
      EXPECT_GT(pictures, 0);
    }
  }

  TemporaryDirectory folder_;
};

TEST_F(MeshJourney, MountainsMeetAndAreTrue) {
  const FunctionSource source(
      {{2, 0, 0, 900, 700, [](int64_t x, int64_t y) { return roughGround(x, y, 3); }}}, 0.1, 0.05);
  const auto terrain = build(source);
  expectNoGaps(*terrain, 1, 6);
  expectTruePictures(*terrain, 1);
  expectHiddenIsHidden(*terrain, 1, 40, 200);
}

TEST_F(MeshJourney, BoundedGroundMeetsAndIsTrue) {
  const FunctionSource source(
      {{2, 0, 0, 900, 700, [](int64_t x, int64_t y) { return roughGround(x, y, 4); }}}, 4.0, 4.0);
  const auto terrain = build(source);
  expectNoGaps(*terrain, 2, 6);
  expectTruePictures(*terrain, 2);
}

TEST_F(MeshJourney, HolesChangeNothing) {
  const float none = std::numeric_limits<float>::quiet_NaN();
  const FunctionSource source({{2, 0, 0, 800, 800,
                                [none](int64_t x, int64_t y) {
                                  const double dx = double(x) - 400.0, dy = double(y) - 420.0;
                                  const bool outside =
                                      std::hypot(dx, dy) > 340.0 + 30.0 * std::sin(std::atan2(dy, dx) * 9.0);
                                  const bool hole = std::hypot(dx + 100.0, dy - 60.0) < 45.0;
                                  return outside || hole ? none : roughGround(x, y, 5);
                                }}},
                              1.0, 0.0);
  const auto terrain = build(source);
  expectNoGaps(*terrain, 3, 6);
  expectTruePictures(*terrain, 3);
  expectHiddenIsHidden(*terrain, 3, 40, 20);
}

TEST_F(MeshJourney, AFineVillageInACoarseCountryMeets) {
  const FunctionSource source(
      {{1, 0, 0, 300, 300, [](int64_t x, int64_t y) { return roughGround(x * 8, y * 8, 6); }},
       {4, 1000, 1300, 1300, 1500,
        [](int64_t x, int64_t y) {
          return roughGround(x, y, 6) + static_cast<float>(20.0 * std::sin(double(x) * 0.3));
        }}},
      0.1, 0.05);
  const auto terrain = build(source);
  expectNoGaps(*terrain, 4, 6);
  expectTruePictures(*terrain, 4);
}

TEST_F(MeshJourney, RealGroundMeets) {
  const std::filesystem::path data = std::filesystem::path(TERRANE_SOURCE_DIR) / "../shared/data";
  int seen = 0;
  for (const char* file : {"bigtujunga/bigtujunga.tif", "swiss_alps_n46e008/N46E008.tif",
                           "mt_hood/lf_elev_220_mt_hood_utm.tif", "new_zealand_1km/nz_elev.tif"}) {
    const std::filesystem::path input = data / file;
    if (!std::filesystem::exists(input)) continue;
    const std::string output = folder_.file("real.terrane");
    ASSERT_EQ(Program({"build", input.string(), "-o", output, "--overwrite", "-q"}).wait(), 0);
    const auto terrain = open(output);
    std::printf("%s: ", file);
    expectNoGaps(*terrain, 7, 3);
    ++seen;
  }
  if (seen == 0) std::printf("no real rasters in ../shared/data: the made-up ground stands alone\n");
}

}  // namespace
}  // namespace terrane
