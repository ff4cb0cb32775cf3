#include "terrane/lod/select_patches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/geometric.hpp>

#include "cut_checks.h"
#include "terrane/lod/octagon.h"
#include "terrane/lod/screen_metric.h"

namespace terrane {
namespace {

TEST(SelectPatches, ConformsWhateverIsResident) {
  for (uint32_t seed = 0; seed < 12; ++seed) {
    std::mt19937 random(seed);
    const FakeWorld world(2, seed);
    for (int k = 2; k <= 7; ++k) {
      FakeResidents residents(world, randomResidents(random, 2, 0.1 + 0.2 * (seed % 5)));
      PatchSelection selection;
      selection.grid.k = k;
      selection.cull = false;
      selection.tolerancePixels = std::exp2(static_cast<double>(random() % 6) - 2.0);
      const Cut cut =
          selectPatches(selection, world.frame, world.scale, randomCamera(random, world), residents);
      expectConforming(cut);
      for (const Patch& patch : cut.patches) {
        EXPECT_NE(residents.find(patch.tile), nullptr);
        EXPECT_NE(residents.find(patch.shadingTile), nullptr);
      }
      for (const TileWish& w : cut.wishes) {
        EXPECT_EQ(residents.find(w.tile), nullptr);
        EXPECT_NE(residents.find(w.tile.parent()), nullptr);
        EXPECT_TRUE(std::isfinite(w.errorPixels));
        EXPECT_LT(w.errorAfterPixels, w.errorPixels);
        EXPECT_GE(w.errorAfterPixels, 0.0F);
        EXPECT_GE(w.areaPixels, 1.0F);
      }
    }
  }
}

/// One step of error codes: how much larger a diamond's error is than its children's, at least.
const double kSaturation = std::exp2(0.125);

/// The finest conforming cut by brute force: all diamonds that want to split and whose tiles are resident,
/// then take away those with a parent that does not split, until nothing changes.
std::set<Diamond> greatestCut(const FakeWorld& world, const FakeResidents& residents,
                              const PatchSelection& selection, const Camera& camera) {
  const Lattice lattice(world.finestLevel);
  const int deepest = selection.grid.deepestLevel(world.finestLevel);
  const NestedOctagons octagons(lattice, deepest);
  const ScreenMetric metric(camera, {world.frame.spacingXMeters(), world.frame.spacingYMeters()},
                            selection.tolerancePixels, selection.nearMeters);
  std::set<Diamond> splits, level = {{lattice.side() / 2, lattice.side() / 2, 0}};
  for (int n = 0; n < deepest; ++n) {
    std::set<Diamond> next;
    for (const Diamond& d : level) {
      FakeWorld::Code code = world.codes.at(d);
      code.error = errorCodeOf(world, selection.grid, d);
      bool known = true;
      for (const Triangle& t : lattice.trianglesAfterSplit(d))
        known = known && residents.find(lattice.tileOf(t, selection.grid.tileLevel(n + 1))) != nullptr;
      const double error = world.scale.errorFromCode(code.error);
      const Prism prism{{d.x, d.y},
                        octagons.nested(n),
                        world.scale.heightFromRangeCode(code.low) - error,
                        world.scale.heightFromRangeCode(code.high) + error};
      bool wants = metric.errorPixels(prism, error) > selection.tolerancePixels;
      const double spacing = world.frame.spacingYMeters() * std::ldexp(1.0, world.finestLevel - n / 2);
      const double texel =
          metric.lengthPixels(prism, spacing) * (selection.morph && n % 2 == 0 ? kSaturation : 1.0);
      if (n / 2 < world.finestLevel) wants = wants || texel > 1.5;
      if (wants && known) splits.insert(d);
      for (const Diamond& c : lattice.children(d)) next.insert(c);
    }
    level = next;
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (auto at = splits.begin(); at != splits.end();) {
      bool supported = true;
      for (const Diamond& p : lattice.parents(*at)) supported = supported && splits.count(p) != 0;
      if (supported) {
        ++at;
      } else {
        at = splits.erase(at);
        changed = true;
      }
    }
  }
  return splits;
}

TEST(SelectPatches, IsTheFinestCutThatTheResidentTilesAllow) {
  for (uint32_t seed = 0; seed < 10; ++seed) {
    std::mt19937 random(100 + seed);
    const FakeWorld world(2, seed);
    for (const int k : {4, 5, 7}) {
      FakeResidents residents(world, randomResidents(random, 2, 0.6));
      PatchSelection selection;
      selection.grid.k = k;
      selection.cull = false;
      selection.morph = seed % 3 != 0;
      selection.tolerancePixels = 2.0;
      const Camera camera = randomCamera(random, world);
      const Cut cut = selectPatches(selection, world.frame, world.scale, camera, residents);
      EXPECT_EQ(splitDiamonds(cut), greatestCut(world, residents, selection, camera))
          << "seed " << seed << " k " << k;
    }
  }
}

TEST(SelectPatches, LoadingTheWishesInAnyOrderLeadsToTheSameCut) {
  for (uint32_t seed = 0; seed < 6; ++seed) {
    std::mt19937 random(200 + seed);
    const FakeWorld world(2, seed);
    const Camera camera = randomCamera(random, world);
    const PatchSelection selection;
    std::set<TileId> all;
    for (const auto& [id, tile] : world.tiles) all.insert(id);
    FakeResidents everything(world, all);
    const Cut goal = selectPatches(selection, world.frame, world.scale, camera, everything);
    EXPECT_TRUE(goal.wishes.empty());

    FakeResidents residents(world, {});
    Cut cut = selectPatches(selection, world.frame, world.scale, camera, residents);
    size_t triangles = 0;
    for (int steps = 0; !cut.wishes.empty(); ++steps) {
      ASSERT_LT(steps, 1000);
      residents.ids().insert(cut.wishes[random() % cut.wishes.size()].tile);
      cut = selectPatches(selection, world.frame, world.scale, camera, residents);
      triangles = std::max(triangles, cut.patches.size());
    }
    ASSERT_EQ(cut.patches.size(), goal.patches.size());
    for (size_t i = 0; i < cut.patches.size(); ++i) {
      EXPECT_EQ(cut.patches[i].triangle, goal.patches[i].triangle);
      EXPECT_EQ(cut.patches[i].shadingTile, goal.patches[i].shadingTile);
    }
  }
}

TEST(SelectPatches, WithEverythingResidentEveryPatchInViewKeepsTheTolerance) {
  for (uint32_t seed = 0; seed < 10; ++seed) {
    std::mt19937 random(300 + seed);
    const FakeWorld world(2, seed);
    std::set<TileId> all;
    for (const auto& [id, tile] : world.tiles) all.insert(id);
    const FakeResidents residents(world, all);
    PatchSelection selection;
    selection.grid.k = 3 + static_cast<int>(seed % 4);
    selection.tolerancePixels = 3.0;
    const Cut cut =
        selectPatches(selection, world.frame, world.scale, randomCamera(random, world), residents);
    for (const Patch& patch : cut.patches) {
      if (patch.triangle.diamond.level < selection.grid.deepestLevel(2)) {
        EXPECT_LE(patch.errorPixels, 3.0F);
      }
    }
  }
}

TEST(SelectPatches, CullingOnlyLeavesOutWhatIsOutOfView) {
  for (uint32_t seed = 0; seed < 10; ++seed) {
    std::mt19937 random(400 + seed);
    const FakeWorld world(2, seed);
    std::set<TileId> all;
    for (const auto& [id, tile] : world.tiles) all.insert(id);
    const FakeResidents residents(world, all);
    const Camera camera = randomCamera(random, world);
    PatchSelection selection;
    const Cut culled = selectPatches(selection, world.frame, world.scale, camera, residents);
    const Lattice lattice(culled.latticeDepth);
    // Points of the ground that are in the window lie under exactly one patch.
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const double side = lattice.side();
    for (int i = 0; i < 2000; ++i) {
      const glm::dvec2 cell(unit(random) * side, unit(random) * side);
      // Heights that every node's range holds: none is sure, so take the middle of the finest node there.
      const glm::dvec3 local(cell.x * world.frame.spacingXMeters(), -cell.y * world.frame.spacingYMeters(),
                             world.scale.heightFromRangeCode(3500));
      const glm::dvec3 view = camera.viewFromLocal(local);
      const glm::dvec2 pixel = camera.pixelFromLocal(local);
      if (view.z <= 1.0 || pixel.x < 0 || pixel.y < 0 || pixel.x > 640 || pixel.y > 360) continue;
      int hits = 0;
      bool rangeHolds = true;
      for (const Patch& patch : culled.patches) {
        const auto c = cornersOf(lattice, patch.triangle);
        const auto cross = [&](size_t a, size_t b) {
          return (c[b].x - c[a].x) * (cell.y - c[a].y) - (c[b].y - c[a].y) * (cell.x - c[a].x);
        };
        const double x = cross(0, 1), y = cross(1, 2), z = cross(2, 0);
        if ((x > 0 && y > 0 && z > 0) || (x < 0 && y < 0 && z < 0)) ++hits;
      }
      // Where no patch is drawn the whole column of the finest node must be outside of the window.
      if (hits == 0) {
        const TileId id{2, static_cast<int>(cell.x) / kTileCells, static_cast<int>(cell.y) / kTileCells};
        const auto at =
            static_cast<size_t>(nodeIndex(8, static_cast<int>(cell.x) % kTileCells / 16 * 16 + 8,
                                          static_cast<int>(cell.y) % kTileCells / 16 * 16 + 8, false));
        const TileNodes& nodes = world.tiles.at(id).nodes;
        rangeHolds = nodes.low[at] <= 3500 && nodes.high[at] >= 3500;
      }
      EXPECT_LE(hits, 1);
      if (rangeHolds) {
        EXPECT_EQ(hits, 1);
      }
    }
  }
}

TEST(SelectPatches, TheMetricsThatOnlyShowAlsoConform) {
  std::mt19937 random(5);
  const FakeWorld world(1, 5);
  std::set<TileId> all;
  for (const auto& [id, tile] : world.tiles) all.insert(id);
  const FakeResidents residents(world, all);
  for (const SplitMetric metric : {SplitMetric::DistanceOnly, SplitMetric::ErrorOnly}) {
    PatchSelection selection;
    selection.metric = metric;
    selection.cull = false;
    selection.levelsBelowData = 2;
    for (int i = 0; i < 20; ++i) {
      const Cut cut =
          selectPatches(selection, world.frame, world.scale, randomCamera(random, world), residents);
      expectConforming(cut);
      EXPECT_TRUE(cut.wishes.empty());
    }
  }
}

TEST(SelectPatches, WithoutTheRootThereIsOnlyAWish) {
  const FakeWorld world(1, 1);
  FakeResidents residents(world, {});
  std::mt19937 random(1);
  const Cut cut = selectPatches({}, world.frame, world.scale, randomCamera(random, world), residents);
  EXPECT_TRUE(cut.patches.empty());
  ASSERT_EQ(cut.wishes.size(), 1u);
  EXPECT_EQ(cut.wishes[0].tile, TileId{});
}

TEST(NodeErrorCode, IsStrictlySaturatedForEveryK) {
  const FakeWorld world(1, 9);
  const Lattice lattice(1);
  for (int k = PatchGrid::kSmallest; k <= PatchGrid::kLargest; ++k) {
    const PatchGrid grid{k};
    const int deepest = std::min(grid.deepestLevel(1), lattice.deepestLevel());
    std::set<Diamond> level = {{lattice.side() / 2, lattice.side() / 2, 0}};
    for (int n = 0; n < deepest; ++n) {
      std::set<Diamond> next;
      for (const Diamond& d : level) {
        const int code = errorCodeOf(world, grid, d);
        for (const Diamond& c : lattice.children(d)) {
          const int child = errorCodeOf(world, grid, c);
          if (child != 255) {
            EXPECT_GT(code, child) << "k " << k << " level " << n;
          }
          next.insert(c);
        }
      }
      level = next;
    }
  }
}

}  // namespace
}  // namespace terrane
