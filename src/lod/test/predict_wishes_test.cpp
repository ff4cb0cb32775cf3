#include "terrane/lod/predict_wishes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>

#include "fake_world.h"
#include "terrane/codec/mesh_level.h"
#include "terrane/lod/screen_metric.h"

namespace terrane {
namespace {

Camera randomHighCamera(std::mt19937& random, const FakeWorld& world) {
  const double side = world.frame.spacingXMeters() * static_cast<double>(world.frame.worldCells());
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const glm::dvec3 eye(unit(random) * side, -unit(random) * side,
                       150.0 + 3000.0 * unit(random) * unit(random));
  const glm::dvec3 target(unit(random) * side, -unit(random) * side, 50.0);
  return lookAt(eye, target, 0.4 + 1.0 * unit(random), 640, 360);
}

/// A tile's square, as high as its own nodes say.
bool isInView(const FakeWorld& world, const Camera& camera, TileId id) {
  const ScreenMetric metric(camera, {world.frame.spacingXMeters(), world.frame.spacingYMeters()}, 1.0, 0.1);
  const double half = 0.5 * kTileCells * std::exp2(world.finestLevel - id.level);
  const Prism everything{{(2 * id.col + 1) * half, (2 * id.row + 1) * half},
                         {half, 2.0 * half},
                         world.scale.heightFromRangeCode(0),
                         world.scale.heightFromRangeCode(65535)};
  return metric.visible(everything);
}

struct Guesses {
  std::vector<TileWish> wishes;
  std::vector<TileWish> guesses;
};

Guesses guess(const FakeWorld& world, const FakeResidents& residents, const Camera& camera,
              const std::set<TileId>& stored, size_t most) {
  Guesses out;
  out.wishes = selectPatches({}, world.frame, world.scale, camera, residents).wishes;
  out.guesses = predictWishes(
      out.wishes, {}, world.frame, world.scale, camera, residents,
      [&](TileId id) { return stored.count(id) != 0; }, most);
  return out;
}

TEST(PredictWishes, NamesOnlyWhatCanBeFetchedAndParentsFirst) {
  size_t named = 0;
  for (uint32_t seed = 0; seed < 8; ++seed) {
    std::mt19937 random(seed);
    const FakeWorld world(3, seed);
    std::set<TileId> stored, resident;
    for (const TileId id : FakeWorld::allTiles(3)) {
      if (id.isRoot() || (stored.count(id.parent()) != 0 && random() % 5 != 0)) stored.insert(id);
      if (id.isRoot() || (resident.count(id.parent()) != 0 && stored.count(id) != 0 && random() % 2 != 0))
        resident.insert(id);
    }
    for (int view = 0; view < 12; ++view) {
      const Camera camera = randomHighCamera(random, world);
      const FakeResidents residents(world, view == 0 ? std::set<TileId>() : resident);
      const Guesses all = guess(world, residents, camera, stored, 1000);
      named += all.guesses.size();
      std::set<TileId> here;
      for (const TileWish& wish : all.wishes) here.insert(wish.tile);
      float before = std::numeric_limits<float>::infinity();
      for (const TileWish& wish : all.guesses) {
        const TileId id = wish.tile;
        EXPECT_NE(stored.count(id), 0U) << toString(id);
        EXPECT_EQ(residents.find(id), nullptr) << toString(id);
        EXPECT_NE(here.count(id.parent()), 0U) << toString(id) << " before its parent";
        EXPECT_TRUE(here.insert(id).second) << toString(id) << " twice";
        EXPECT_TRUE(isInView(world, camera, id)) << toString(id);
        EXPECT_LE(wish.errorPixels, before);
        EXPECT_LT(wish.errorAfterPixels, wish.errorPixels);
        EXPECT_GE(wish.areaPixels, 1.0F);
        EXPECT_LE(wish.areaPixels, 640.0F * 360.0F * 1.001F);
        before = wish.errorPixels;
      }
      // Fewer are the first of them.
      const Guesses some = guess(world, residents, camera, stored, 5);
      ASSERT_EQ(some.guesses.size(), std::min<size_t>(5, all.guesses.size()));
      for (size_t i = 0; i < some.guesses.size(); ++i) EXPECT_EQ(some.guesses[i].tile, all.guesses[i].tile);
    }
  }
  EXPECT_GT(named, 500U);
}

TEST(PredictWishes, CoversMostOfWhatIsWishedLater) {
  size_t wished = 0, guessed = 0, right = 0;
  for (uint32_t seed = 0; seed < 6; ++seed) {
    std::mt19937 random(50 + seed);
    const FakeWorld world(4, seed);
    std::set<TileId> all;
    for (const TileId id : FakeWorld::allTiles(4)) all.insert(id);
    for (int view = 0; view < 12; ++view) {
      const Camera camera = randomHighCamera(random, world);
      FakeResidents residents(world, {TileId{}});
      const Guesses first = guess(world, residents, camera, all, 100000);
      std::set<TileId> guesses, later;
      for (const TileWish& wish : first.guesses) guesses.insert(wish.tile);
      std::vector<TileWish> wishes = first.wishes;
      for (bool isFirst = true; !wishes.empty(); isFirst = false) {
        for (const TileWish& wish : wishes) {
          residents.ids().insert(wish.tile);
          if (!isFirst) later.insert(wish.tile);
        }
        wishes = selectPatches({}, world.frame, world.scale, camera, residents).wishes;
      }
      wished += later.size();
      guessed += guesses.size();
      for (const TileId id : later) right += guesses.count(id);
    }
  }
  const double covered = static_cast<double>(right) / static_cast<double>(wished);
  const double used = static_cast<double>(right) / static_cast<double>(guessed);
  std::printf("of %zu tiles that were wished later %.3f were named before; of those named %.3f were wished\n",
              wished, covered, used);
  EXPECT_GE(covered, 0.8);
  EXPECT_GE(used, 0.5);
}

/// Flat ground at height 0 of which no tile says that it has an error: what is wished for, meshes' bounds
/// ask.
FakeWorld smoothWorld(int finestLevel) {
  FakeWorld world(finestLevel, 1);
  const auto ground = static_cast<uint16_t>(-world.scale.rangeBase / world.scale.rangeUnit);
  for (auto& [id, tile] : world.tiles) {
    for (ChildSummary& child : tile.children) child.error = 0, child.low = child.high = ground;
    tile.nodes.error.assign(tile.nodes.error.size(), 0);
  }
  return world;
}

std::set<TileId> guessOverMeshes(const FakeWorld& world, const std::set<TileId>& resident,
                                 const Camera& camera, SurfaceKind surface) {
  PatchSelection selection;
  selection.surface = surface;
  selection.texelPixels = 1e9;
  std::set<TileId> out;
  // Nothing is wished for: no mesh is made yet.
  for (const TileWish& wish : predictWishes(
           {}, selection, world.frame, world.scale, camera, FakeResidents(world, resident),
           [](TileId) { return true; }, 10000))
    EXPECT_TRUE(out.insert(wish.tile).second) << toString(wish.tile) << " twice";
  return out;
}

TEST(PredictWishes, KnowsOfMeshesFromTheRootOnWhatTheirBoundsWillAskFor) {
  size_t needed = 0, guessed = 0;
  const FakeWorld world = smoothWorld(4);
  const MeshScale scale = MeshScale::of(world.frame, world.scale);
  std::mt19937 random(3);
  for (int view = 0; view < 40; ++view) {
    const Camera camera = randomHighCamera(random, world);
    const std::set<TileId> guesses = guessOverMeshes(world, {TileId{}}, camera, SurfaceKind::Meshes);
    EXPECT_TRUE(guessOverMeshes(world, {TileId{}}, camera, SurfaceKind::Patches).empty());
    EXPECT_TRUE(guessOverMeshes(world, {}, camera, SurfaceKind::Meshes).empty());

    // The ground in every eighth pixel: where the bound above a tile's meshes is a pixel or more, the tile.
    std::set<TileId> seen;
    for (int y = 4; y < camera.height; y += 8) {
      for (int x = 4; x < camera.width; x += 8) {
        const glm::dvec3 ray = camera.rayThroughPixel({x, y});
        if (ray.z >= -1e-6) continue;
        const glm::dvec3 ground = camera.eyeLocal + ray * (-camera.eyeLocal.z / ray.z);
        const glm::dvec2 sample = world.frame.sampleFromLocal({ground.x, ground.y});
        const auto side = static_cast<double>(world.frame.worldCells());
        if (sample.x < 0.0 || sample.y < 0.0 || sample.x >= side || sample.y >= side) continue;
        // A vertical metre there, in pixels.
        const double up = 1e-3;
        const double metre = glm::distance(camera.pixelFromLocal(ground),
                                           camera.pixelFromLocal(ground + glm::dvec3(0, 0, up))) /
                             up;
        for (int level = 1; level <= world.finestLevel; ++level) {
          const double bound = scale.boundMeters(scale.lastOwnLevel() + 2 * (level - 1));
          if (bound * metre <= 1.001) break;
          const double cells = std::exp2(world.finestLevel - level) * kTileCells;
          seen.insert({level, static_cast<int>(sample.x / cells), static_cast<int>(sample.y / cells)});
        }
      }
    }
    for (const TileId id : seen) EXPECT_EQ(guesses.count(id), 1U) << toString(id) << " in view " << view;
    needed += seen.size();
    guessed += guesses.size();
  }
  std::printf("%zu tiles needed, %zu named\n", needed, guessed);
  EXPECT_GT(needed, 1000U);
  EXPECT_LE(static_cast<double>(guessed), 2.0 * static_cast<double>(needed));
}

TEST(PredictWishes, NamesTheSameTilesOfMeshesWhicheverAreHere) {
  const FakeWorld world = smoothWorld(4);
  std::mt19937 random(8);
  size_t here = 0;
  for (int view = 0; view < 40; ++view) {
    const Camera camera = randomHighCamera(random, world);
    std::set<TileId> expected = guessOverMeshes(world, {TileId{}}, camera, SurfaceKind::Meshes);
    std::set<TileId> resident = {TileId{}};
    for (const TileId id : FakeWorld::allTiles(4))
      if (!id.isRoot() && resident.count(id.parent()) != 0 && random() % 2 != 0) resident.insert(id);
    for (const TileId id : resident) here += expected.erase(id);
    EXPECT_EQ(guessOverMeshes(world, resident, camera, SurfaceKind::Meshes), expected);
  }
  EXPECT_GT(here, 100U);
}

/// Samples that are too wrong for their meshes to keep to the bound: these say so, before they are made.
TEST(PredictWishes, KnowsOfMeshesThatWillStateMoreThanTheirBounds) {
  const FakeWorld smooth = smoothWorld(4);
  FakeWorld rough = smoothWorld(4);
  Tile& root = rough.tiles.at(TileId{});
  root.nodes.error.assign(root.nodes.error.size(), 255);
  std::mt19937 random(9);
  size_t more = 0;
  for (int view = 0; view < 40; ++view) {
    const Camera camera = randomHighCamera(random, smooth);
    const std::set<TileId> few = guessOverMeshes(smooth, {TileId{}}, camera, SurfaceKind::Meshes);
    const std::set<TileId> many = guessOverMeshes(rough, {TileId{}}, camera, SurfaceKind::Meshes);
    EXPECT_TRUE(std::includes(many.begin(), many.end(), few.begin(), few.end()));
    more += many.size() - few.size();
  }
  EXPECT_GT(more, 100U);
}

}  // namespace
}  // namespace terrane
