#include "terrane/engine/terrain_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "function_source.h"
#include "temporary_directory.h"
#include "terrane/bake/build.h"
#include "terrane/engine/terrain.h"
#include "terrane/stream/simulated_line.h"

/// A view streams in simulated time, without a GPU.
namespace terrane {
namespace {

class TerrainViewTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory();
    BuildOptions options;
    options.output = directory();
    const auto hills = [](int64_t x, int64_t y) {
      const double u = static_cast<double>(x), v = static_cast<double>(y);
      return static_cast<float>(400.0 * std::sin(u / 91.0) * std::cos(v / 73.0) +
                                60.0 * std::sin(u / 9.0 + v / 7.0));
    };
    const FunctionSource source({{.level = 3, .x0 = 0, .y0 = 0, .x1 = 2048, .y1 = 2048, .height = hills}},
                                0.1, 0.05);
    SilentProgress silent;
    const auto built = buildDataset(source, options, silent);
    ASSERT_TRUE(built.ok()) << built.error().message;
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::string directory() { return folder_->file("made.terrane"); }

  struct Seen {
    std::unique_ptr<Workers> workers = makeInlineWorkers();
    SimulatedLine* line = nullptr;
    std::unique_ptr<TerrainView> view;
    double now = 0.0;

    bool update(const Camera& camera) {
      const auto changed = view->update(camera, now += 1.0 / 60.0);
      EXPECT_TRUE(changed.ok()) << changed.error().message;
      return changed.ok() && *changed;
    }
    double settle(const Camera& camera, double most = 60.0) {
      const double begun = now;
      do update(camera);
      while (!view->isSettled() && now < begun + most);
      return now - begun;
    }
  };
  static Seen see(const ViewOptions& options = {}, LineModel model = {}, const LineFaults& faults = {}) {
    Seen out;
    auto line = std::make_unique<SimulatedLine>(directory(), model, faults);
    out.line = line.get();
    out.view = std::make_unique<TerrainView>(std::move(line), *out.workers, nullptr, options);
    return out;
  }
  static Camera cameraAt(double east, double north, double up, double ahead = 4000.0) {
    return lookAt({east, north, up}, {east + ahead, north + 0.6 * ahead, 0.0}, 1.0, 640, 360);
  }
  /// Patches as values that can be compared.
  static std::multiset<std::tuple<int, int, int, int, int>> patchesOf(const Cut& cut) {
    std::multiset<std::tuple<int, int, int, int, int>> out;
    for (const Patch& patch : cut.patches)
      out.insert({patch.triangle.diamond.x, patch.triangle.diamond.y, patch.triangle.diamond.level,
                  patch.triangle.apex.x, patch.triangle.apex.y});
    return out;
  }

  static TemporaryDirectory* folder_;
};
TemporaryDirectory* TerrainViewTest::folder_ = nullptr;

TEST_F(TerrainViewTest, SettlesOnTheCutThatEverythingResidentGives) {
  Seen seen = see();
  auto terrain = Terrain::open(directory());
  ASSERT_TRUE(terrain.ok());
  for (const double east : {1000.0, 9000.0, 15000.0}) {
    const Camera camera = cameraAt(east, -12000.0, 900.0);
    EXPECT_LT(seen.settle(camera), 5.0);
    ASSERT_TRUE(seen.view->isSettled());
    const auto expected = (*terrain)->selectAndLoad(camera, {});
    ASSERT_TRUE(expected.ok());
    EXPECT_EQ(patchesOf(seen.view->cut()), patchesOf(*expected));
    for (const Patch& patch : seen.view->cut().patches) EXPECT_LE(patch.errorPixels, 1.0F);
  }
  EXPECT_LE(seen.view->report().mostFramesUntilUsed, 2);
}

TEST_F(TerrainViewTest, AnotherRendererFindsWhatIsDecoded) {
  Seen seen = see();
  const Camera camera = cameraAt(9000.0, -12000.0, 900.0);
  seen.view->open(0.0);
  EXPECT_EQ(seen.view->phase(), StreamPhase::Opening);
  seen.settle(camera);
  const auto before = patchesOf(seen.view->cut());
  const uint64_t requests = seen.view->report().stream.requests;
  const uint64_t decoded = seen.view->report().stream.tilesDecoded;
  seen.view->setRenderer(nullptr);
  EXPECT_TRUE(seen.view->cut().patches.empty());
  EXPECT_TRUE(seen.update(camera));
  seen.settle(camera);
  EXPECT_EQ(patchesOf(seen.view->cut()), before);
  EXPECT_EQ(seen.view->report().stream.requests, requests);
  EXPECT_EQ(seen.view->report().stream.tilesDecoded, decoded);
}

TEST_F(TerrainViewTest, NothingIsDrawnWhereNothingChanged) {
  Seen seen = see();
  const Camera camera = cameraAt(3000.0, -9000.0, 700.0);
  seen.settle(camera);
  for (int i = 0; i < 120; ++i) EXPECT_FALSE(seen.update(camera)) << i;
  seen.view->requestRender();
  EXPECT_TRUE(seen.update(camera));
  EXPECT_FALSE(seen.update(camera));
  EXPECT_TRUE(seen.update(cameraAt(3000.5, -9000.0, 700.0)));
  seen.settle(cameraAt(3000.5, -9000.0, 700.0));
  seen.view->selection().tolerancePixels = 2.0;
  seen.view->setFrameControl({.leastTau = 2.0, .mostTau = 2.0});
  EXPECT_TRUE(seen.update(cameraAt(3000.5, -9000.0, 700.0)));
}

TEST_F(TerrainViewTest, SmallCachesCoarsenThePictureAndKeepItWhole) {
  ViewOptions options;
  options.gpuGeometryBytes = options.stream.decodedBytes = 2U << 20;
  options.gpuTextureBytes = options.stream.pictureBytes = 4U << 20;
  Seen seen = see(options);
  for (int i = 0; i < 1500; ++i) {
    seen.update(cameraAt(1000.0 + 8.0 * i, -14000.0 + 4.0 * i, 500.0));
    const ViewReport& report = seen.view->report();
    EXPECT_LE(report.tilesOnGpu, 7U);
    EXPECT_LE(report.stream.decodedBytes, (2U << 20) + 3 * 350000U);
    if (i > 60) {
      EXPECT_GT(report.patches, 0);
    }
  }
  EXPECT_GT(seen.view->report().memoryFactor, 1.0);
  EXPECT_LE(seen.view->report().memoryFactor, 64.0);
  // It comes to rest: what is here is not fetched over and over.
  const Camera camera = cameraAt(8000.0, -9000.0, 500.0);
  for (int i = 0; i < 1200; ++i) seen.update(camera);
  const uint64_t uploaded = seen.view->report().tilesUploaded;
  for (int i = 0; i < 600; ++i) seen.update(camera);
  EXPECT_LE(seen.view->report().tilesUploaded, uploaded + 10);
}

TEST_F(TerrainViewTest, MeshesSettleOnTheirCutToo) {
  ViewOptions options;
  options.selection.surface = SurfaceKind::Meshes;
  Seen seen = see(options);
  auto terrain = Terrain::open(directory());
  ASSERT_TRUE(terrain.ok());
  for (const double east : {1000.0, 9000.0, 15000.0}) {
    const Camera camera = cameraAt(east, -12000.0, 500.0);
    EXPECT_LT(seen.settle(camera), 5.0);
    ASSERT_TRUE(seen.view->isSettled());
    const auto expected = (*terrain)->selectAndLoad(camera, options.selection);
    ASSERT_TRUE(expected.ok());
    EXPECT_EQ(patchesOf(seen.view->cut()), patchesOf(*expected));
    for (const Patch& patch : seen.view->cut().patches) EXPECT_LE(patch.errorPixels, 1.0F);
    EXPECT_LT(seen.view->report().triangles, 500000);
    for (int i = 0; i < 30; ++i) EXPECT_FALSE(seen.update(camera));
  }
}

/// What no camera of late looked at goes, and is made again where it is needed again.
TEST_F(TerrainViewTest, MeshesKeepWithinTheirBudget) {
  ViewOptions options;
  options.selection.surface = SurfaceKind::Meshes;
  const auto fly = [&](uint64_t bytes) {
    options.meshBytes = bytes;
    Seen seen = see(options);
    const auto at = [](int i) { return cameraAt(1000.0 + 15.0 * i, -14000.0 + 5.0 * i, 400.0); };
    uint64_t most = 0;
    for (int i = 0; i < 1000; ++i) {
      seen.update(at(i));
      if (i < 300) continue;
      most = std::max(most, seen.view->report().meshBytes);
    }
    // Back where it began, and as fine as then.
    seen.settle(at(0));
    EXPECT_TRUE(seen.view->isSettled());
    auto terrain = Terrain::open(directory());
    const auto expected = (*terrain)->selectAndLoad(at(0), options.selection);
    EXPECT_TRUE(expected.ok() && patchesOf(seen.view->cut()) == patchesOf(*expected));
    return most;
  };
  const uint64_t all = fly(1U << 30);
  const uint64_t some = fly(all / 2);
  EXPECT_LE(some, all / 2);
  // Too little for what is in use: that stays.
  const uint64_t used = fly(1);
  EXPECT_LT(used, some);
  EXPECT_GT(used, 0U);
  std::printf("meshes: %.1f MB, %.1f where half of it is allowed, %.1f at least\n",
              1e-6 * static_cast<double>(all), 1e-6 * static_cast<double>(some),
              1e-6 * static_cast<double>(used));
}

/// Whatever comes, goes and is made meanwhile, there is a picture; also when the surface changes in flight.
TEST_F(TerrainViewTest, MeshesAreWholeInSmallCachesAndWithFaults) {
  ViewOptions options;
  options.gpuGeometryBytes = options.stream.decodedBytes = 3U << 20;
  options.gpuTextureBytes = options.stream.pictureBytes = 6U << 20;
  LineFaults faults;
  faults.busyShare = faults.corruptShare = 0.1;
  Seen seen = see(options, {}, faults);
  const auto at = [](int i) { return cameraAt(1000.0 + 10.0 * i, -14000.0 + 5.0 * i, 400.0); };
  int first = 0;
  for (int i = 0; i < 900; ++i) {
    if (i % 100 == 50) {
      SurfaceKind& surface = seen.view->selection().surface;
      surface = surface == SurfaceKind::Meshes ? SurfaceKind::Patches : SurfaceKind::Meshes;
    }
    seen.update(at(i));
    if (first == 0 && seen.view->report().patches > 0) first = i;
    if (first > 0) {
      ASSERT_GT(seen.view->report().patches, 0) << i;
    }
  }
  EXPECT_GT(first, 0);
}

TEST_F(TerrainViewTest, FaultsAndARestartedServerDelayAndNoMore) {
  for (uint32_t seed = 1; seed <= 3; ++seed) {
    Seen seen = see();
    const Camera start = cameraAt(1000.0, -12000.0, 600.0);
    seen.settle(start);
    LineFaults faults;
    faults.busyShare = faults.slowShare = faults.truncatedShare = faults.corruptShare = 0.025;
    faults.seed = seed;
    faults.outages = {{seen.now + 1.0, seen.now + 4.0}};
    seen.line->setFaults(faults);
    Camera camera = start;
    for (int i = 0; i < 600; ++i) {
      camera = cameraAt(1000.0 + 20.0 * i, -12000.0 + 8.0 * i, 600.0);
      seen.update(camera);
      // Never nothing: the cut covers what is in view, whatever has come.
      ASSERT_FALSE(seen.view->cut().patches.empty());
    }
    seen.settle(camera, 120.0);
    EXPECT_TRUE(seen.view->isSettled());
    for (const Patch& patch : seen.view->cut().patches) EXPECT_LE(patch.errorPixels, 1.0F);
  }
}

TEST_F(TerrainViewTest, OverAThinLineSomethingIsSeenAtOnceAndAllOfItInTheEnd) {
  Seen seen = see({}, {3000.0, 0.05});
  const Camera camera = cameraAt(1000.0, -16000.0, 9000.0, 8000.0);
  while (seen.view->phase() == StreamPhase::Opening && seen.now < 60.0) seen.update(camera);
  const double begun = seen.now;
  while (seen.view->cut().patches.empty() && seen.now < begun + 60.0) seen.update(camera);
  EXPECT_LT(seen.now - begun, 3.0);
  EXPECT_FALSE(seen.view->isSettled());
  EXPECT_LT(seen.settle(camera, 1200.0), 1200.0);
  auto terrain = Terrain::open(directory());
  ASSERT_TRUE(terrain.ok());
  const auto expected = (*terrain)->selectAndLoad(camera, {});
  ASSERT_TRUE(expected.ok());
  EXPECT_EQ(patchesOf(seen.view->cut()), patchesOf(*expected));
}

TEST_F(TerrainViewTest, ATurnShowsWhatCameBeforeWhileFlyingAhead) {
  // Low and straight ahead, then round at once.
  const auto flown = [](bool prefetch) {
    ViewOptions options;
    options.prefetch = prefetch;
    Seen seen = see(options, {1e5, 0.05});
    const auto at = [](double seconds, double ahead) {
      return cameraAt(8000.0 + 300.0 * seconds, -11000.0 + 180.0 * seconds, 120.0, ahead);
    };
    seen.settle(at(0.0, 4000.0));
    const double begun = seen.now;
    while (seen.now < begun + 4.0) seen.update(at(seen.now - begun, 4000.0));
    double debt = 0.0;
    for (int i = 0; i < 15; ++i) {
      seen.update(at(4.0, -4000.0));
      debt += seen.view->report().stream.debt;
    }
    return debt;
  };
  const double with = flown(true), without = flown(false);
  std::printf("debt after the turn %.4g, without fetching ahead %.4g\n", with, without);
  EXPECT_GT(without, 1e5);
  EXPECT_LT(with, 0.2 * without);
}

TEST_F(TerrainViewTest, OtherPoliciesArriveAtTheSamePicture) {
  auto terrain = Terrain::open(directory());
  ASSERT_TRUE(terrain.ok());
  const Camera camera = cameraAt(5000.0, -12000.0, 900.0);
  const auto expected = (*terrain)->selectAndLoad(camera, {});
  ASSERT_TRUE(expected.ok());
  for (const StreamPolicy policy : {StreamPolicy::Progressive, StreamPolicy::AllAtOnce}) {
    ViewOptions options;
    options.policy = policy;
    options.neededTiles = [&](const Camera& at, const PatchSelection& selection) {
      const auto cut = (*terrain)->selectAndLoad(at, selection);
      std::set<TileId> needed = {TileId{}};
      for (const Patch& patch : cut->patches)
        for (TileId id : {patch.tile, patch.shadingTile})
          for (; needed.insert(id).second && !id.isRoot(); id = id.parent()) {
          }
      return std::vector<TileId>(needed.begin(), needed.end());
    };
    Seen seen = see(options);
    seen.settle(camera, 20.0);
    EXPECT_EQ(patchesOf(seen.view->cut()), patchesOf(*expected));
  }
}

TEST(FrameControl, FollowsTheTargetWithinItsBoundsAndRestsInTheDeadBand) {
  FrameControl control({.targetSeconds = 0.016, .leastTau = 1.0, .mostTau = 4.0});
  EXPECT_EQ(control.tau(), 1.0);
  // Twice too slow: coarser, by a tenth a second at most.
  double before = control.tau();
  for (int i = 0; i < 60; ++i) control.frameTook(0.032, 1.0 / 60.0);
  EXPECT_GT(control.tau(), before);
  EXPECT_LE(control.tau(), before * 1.106);
  for (int i = 0; i < 6000; ++i) control.frameTook(0.032, 1.0 / 60.0);
  EXPECT_EQ(control.tau(), 4.0);
  for (int i = 0; i < 200; ++i) control.frameTook(0.016, 1.0 / 60.0);
  before = control.tau();
  for (int i = 0; i < 600; ++i) control.frameTook(0.0163, 1.0 / 60.0);
  EXPECT_EQ(control.tau(), before);
  for (int i = 0; i < 6000; ++i) control.frameTook(0.004, 1.0 / 60.0);
  EXPECT_EQ(control.tau(), 1.0);

  FrameControl fixed({.targetSeconds = 0.016, .leastTau = 2.0, .mostTau = 2.0});
  for (int i = 0; i < 60; ++i) fixed.frameTook(1.0, 1.0);
  EXPECT_EQ(fixed.tau(), 2.0);
}

}  // namespace
}  // namespace terrane
