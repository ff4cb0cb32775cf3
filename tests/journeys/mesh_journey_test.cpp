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

  /// What is wrong of a patch where its morph begins, over what the level before states of smooth ground.
  static double startOf(const Patch& patch, const MeshScale& scale, const ResidentTiles& tiles) {
    const int level = patch.triangle.diamond.level;
    if (level == 0 || scale.boundMeters(level) <= 0.0) return 0.0;
    const MeshLevel& meshes = *tiles.findMeshes(patch.tile, patch.mesh.level);
    const MeshLevel::Patch& made = meshes.patches[static_cast<size_t>(patch.mesh.index)];
    return static_cast<double>(made.startErrorMeters) / scale.boundMeters(level - 1);
  }
  /// The largest error in pixels of a patch at the samples of the finest ground in it that are in the window.
  static double worstOf(const Patch& patch, const Cut& cut, const Camera& camera, Terrain& terrain,
                        ElevationQuery& ground, int64_t& samples) {
    const Frame& frame = terrain.dataset().manifest().frame;
    const DrawnSurface drawn(cut, frame, terrain.tiles());
    const Lattice lattice(cut.latticeDepth);
    const auto ends = lattice.hypotenuse(patch.triangle.diamond);
    const LatticePoint apex = patch.triangle.apex;
    const auto [left, right] = std::minmax({ends[0].x, ends[1].x, apex.x});
    const auto [top, bottom] = std::minmax({ends[0].y, ends[1].y, apex.y});
    double worst = 0.0;
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        const glm::dvec2 place(x * frame.spacingXMeters(), -y * frame.spacingYMeters());
        const auto is = drawn.heightAt(place);
        const auto should = ground.heightAt(place);
        if (!is || !should.ok() || !*should) continue;
        const glm::dvec3 here = camera.viewFromLocal({place, *is});
        const glm::dvec3 there = camera.viewFromLocal({place, **should});
        if (here.z <= 1.0 || there.z <= 1.0 || std::abs(here.x) > here.z * camera.tanHalfX() ||
            std::abs(here.y) > here.z * camera.tanHalfY())
          continue;
        worst = std::max(worst, 0.5 * camera.height / camera.tanHalfY() *
                                    glm::length(glm::dvec2(here) / here.z - glm::dvec2(there) / there.z));
        ++samples;
      }
    }
    return worst;
  }
  /// However far patches have become themselves, nothing is off by more than tau on the screen: those that
  /// begin worst, from all distances at which they do.
  static void expectTruthAtEveryMorph(Terrain& terrain, uint32_t seed, int views) {
    std::mt19937 random(seed);
    const Manifest& manifest = terrain.dataset().manifest();
    const MeshScale scale = MeshScale::of(manifest.frame, manifest.scale);
    ElevationQuery ground(terrain.dataset());
    std::uniform_real_distribution<double> angle(0.0, 6.28);
    PatchSelection selection;
    selection.surface = SurfaceKind::Meshes;
    int64_t samples = 0;
    double worst = 0.0, worstStart = 0.0;
    for (int view = 0; view < views; ++view) {
      const Camera camera = randomCamera(random, terrain);
      const auto far = terrain.selectAndLoad(camera, selection);
      ASSERT_TRUE(far.ok()) << far.error().message;
      if (far->patches.empty()) continue;
      const Patch target =
          *std::max_element(far->patches.begin(), far->patches.end(), [&](const Patch& a, const Patch& b) {
            return startOf(a, scale, terrain.tiles()) < startOf(b, scale, terrain.tiles());
          });
      worstStart = std::max(worstStart, startOf(target, scale, terrain.tiles()));
      const Frame& frame = terrain.dataset().manifest().frame;
      const auto ends = Lattice(far->latticeDepth).hypotenuse(target.triangle.diamond);
      const glm::dvec2 middle(
          frame.spacingXMeters() * (0.25 * (ends[0].x + ends[1].x) + 0.5 * target.triangle.apex.x),
          -frame.spacingYMeters() * (0.25 * (ends[0].y + ends[1].y) + 0.5 * target.triangle.apex.y));
      const auto height = ground.heightAt(middle);
      if (!height.ok() || !*height) continue;
      const glm::dvec3 at(middle, **height);
      // So far away that the patch is small: then hardly anything is left of tau for its nearest corner.
      constexpr int kHeight = 720;
      constexpr double kFovY = 0.4;
      const double distance =
          scale.boundMeters(target.triangle.diamond.level - 1) * 0.5 * kHeight / std::tan(0.5 * kFovY);
      const double around = angle(random);
      const glm::dvec3 away(0.9 * std::cos(around), 0.9 * std::sin(around), 0.44);
      for (int step = 0; step < 16; ++step) {
        const glm::dvec3 eye = at + away * distance * (1.5 - 0.05 * step);
        const Camera near = lookAt(eye, at, kFovY, 1280, kHeight);
        const auto cut = terrain.selectAndLoad(near, selection);
        ASSERT_TRUE(cut.ok()) << cut.error().message;
        for (const Patch& patch : cut->patches)
          if (patch.triangle == target.triangle && patch.morph < 1.0F)
            worst = std::max(worst, worstOf(patch, *cut, near, terrain, ground, samples));
      }
    }
    EXPECT_LE(worst, selection.tolerancePixels);
    EXPECT_GT(samples, 1000);
    EXPECT_GT(worstStart, 1.1);
    std::printf("%lld samples at some morph, at most %.3f pixels off; worst start %.2f\n",
                static_cast<long long>(samples), worst, worstStart);
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
  expectTruthAtEveryMorph(*terrain, 1, 40);
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
    expectTruthAtEveryMorph(*terrain, 7, 20);
    ++seen;
  }
  if (seen == 0) std::printf("no real rasters in ../shared/data: the made-up ground stands alone\n");
}

}  // namespace
}  // namespace terrane
