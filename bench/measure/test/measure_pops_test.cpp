#include "terrane/measure/measure_pops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>

#include "terrane/tiling/node_layout.h"

namespace terrane {
namespace {

/// One tile that is the whole world, one metre a cell.
class OneTile final : public ResidentTiles {
 public:
  explicit OneTile(const std::function<float(int x, int y)>& height) {
    for (int y = 0; y < kTileSamples; ++y)
      for (int x = 0; x < kTileSamples; ++x) tile_.samples.heights.push_back(height(x, y));
  }
  const Tile* find(TileId id) const override { return id.isRoot() ? &tile_ : nullptr; }
  const MeshLevel* findMeshes(TileId id, int level) const override {
    const auto at = meshes_.find(level);
    return id.isRoot() && at != meshes_.end() ? &at->second : nullptr;
  }

  /// Makes the tile's meshes down to a level.
  void makeMeshes(int lastLevel) {
    tile_.samples.states.assign(kTileSampleCount, SampleState::Coded);
    tile_.samples.coverage.kind = Coverage::Kind::Full;
    tile_.nodes.error.assign(static_cast<size_t>(tileNodeCount(true)), 0);
    const MeshLevel* before = nullptr;
    for (int level = 0; level <= lastLevel; ++level)
      before =
          &meshes_.emplace(level, makeMeshLevel({}, tile_, level, before, MeshScale::of(Frame{}, {}), {}))
               .first->second;
  }

 private:
  Tile tile_;
  std::map<int, MeshLevel> meshes_;
};

/// All triangles of a bintree level.
Cut fullCut(const PatchGrid& grid, int level, float morph) {
  const Lattice lattice(0);
  Cut cut;
  cut.grid = grid;
  std::vector<Diamond> diamonds = {lattice.rootTriangles().items[0].diamond};
  for (int n = 0; n < level; ++n) {
    std::vector<Diamond> next;
    for (const Diamond& d : diamonds)
      for (const Diamond& c : lattice.children(d))
        if (std::find(next.begin(), next.end(), c) == next.end()) next.push_back(c);
    diamonds = next;
  }
  for (const Diamond& d : diamonds)
    for (const LatticePoint& apex : lattice.apexes(d)) {
      Patch patch;
      patch.triangle = {d, apex};
      patch.morph = morph;
      cut.patches.push_back(patch);
    }
  return cut;
}

float rough(int x, int y) {
  std::mt19937 random(static_cast<uint32_t>(x * 1000 + y));
  return static_cast<float>(random() % 1000) * 0.01F;
}

TEST(DrawnSurface, IsTheLatticesPiecewiseLinearSurface) {
  const Frame frame;
  const OneTile tiles(rough);
  const Lattice lattice(0);
  std::mt19937 random(4);
  const PatchGrid grid{.k = 3};
  for (int level = 1; level <= grid.rootLevels(); ++level) {
    for (const float morph : {0.0F, 0.3F, 1.0F}) {
      const Cut cut = fullCut(grid, level, morph);
      const DrawnSurface surface(cut, frame, tiles);
      // Vertices of the deepest level that these patches have are `level + 2k - 1` deep; what lies deeper is
      // the mean of its hypotenuse's ends.
      const int newest = level + 2 * grid.k - 1;
      std::function<double(LatticePoint)> expected = [&](LatticePoint p) -> double {
        const double own = static_cast<double>(rough(p.x, p.y));
        if (p.x % 256 == 0 && p.y % 256 == 0) return own;
        const Diamond d = lattice.diamondAt(p);
        if (d.level < newest) return own;
        const auto ends = lattice.hypotenuse(d);
        const double mean = 0.5 * (expected(ends[0]) + expected(ends[1]));
        return d.level == newest ? mean + static_cast<double>(morph) * (own - mean) : mean;
      };
      for (int i = 0; i < 500; ++i) {
        const LatticePoint p{static_cast<int32_t>(random() % 257), static_cast<int32_t>(random() % 257)};
        const auto height = surface.heightAt({static_cast<double>(p.x), -static_cast<double>(p.y)});
        ASSERT_TRUE(height.has_value());
        ASSERT_NEAR(*height, expected(p), 1e-5) << "level " << level << " at " << p.x << " " << p.y;
      }
      EXPECT_FALSE(surface.heightAt({-1.0, -5.0}).has_value());
    }
  }
}

/// The height of the mesh level's triangle that a place is in, found by looking at all of them.
double heightInMeshes(const MeshLevel& meshes, glm::dvec2 at, float morph) {
  const auto area = [](glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  };
  for (const MeshLevel::Patch& patch : meshes.patches) {
    for (uint32_t i = 0; i < patch.indexCount; i += 3) {
      glm::dvec2 places[3];
      double heights[3];
      for (uint32_t j = 0; j < 3; ++j) {
        const PatchVertex& v = meshes.vertices[patch.firstVertex + meshes.indices[patch.firstIndex + i + j]];
        places[j] = {v.x(), v.y()};
        const auto own = static_cast<double>(v.heightMeters), coarse = static_cast<double>(v.coarseMeters);
        heights[j] = coarse + static_cast<double>(morph) * (own - coarse);
      }
      const double whole = area(places[0], places[1], places[2]);
      const double a = area(at, places[1], places[2]) / whole, b = area(places[0], at, places[2]) / whole;
      if (a < 0.0 || b < 0.0 || a + b > 1.0) continue;
      return a * heights[0] + b * heights[1] + (1.0 - a - b) * heights[2];
    }
  }
  ADD_FAILURE() << "no triangle at " << at.x << " " << at.y;
  return 0.0;
}

TEST(DrawnSurface, IsTheMeshesPiecewiseLinearSurface) {
  const Frame frame;
  OneTile tiles([](int x, int y) {
    return static_cast<float>(90.0 * std::sin(0.05 * x) * std::cos(0.03 * y)) + rough(x, y);
  });
  tiles.makeMeshes(8);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const PatchGrid grid = MeshScale::of(frame, {}).grid;
  for (int level = 0; level <= 8; ++level) {
    const MeshLevel& meshes = *tiles.findMeshes({}, level);
    for (const float morph : {0.0F, 0.3F, 1.0F}) {
      Cut cut = fullCut(grid, level, morph);
      cut.surface = SurfaceKind::Meshes;
      const DrawnSurface surface(cut, frame, tiles);
      for (int i = 0; i < 100; ++i) {
        // Anywhere, also on borders of patches, where several have the same height.
        glm::dvec2 at{256.0 * unit(random), 256.0 * unit(random)};
        if (i % 3 == 0) at.x = 16.0 * static_cast<double>(random() % 17);
        if (i % 5 == 0) at.y = at.x;
        const auto height = surface.heightAt({at.x, -at.y});
        ASSERT_TRUE(height.has_value());
        ASSERT_NEAR(*height, heightInMeshes(meshes, at, morph), 1e-4)
            << "level " << level << " at " << at.x << " " << at.y;
      }
      EXPECT_FALSE(surface.heightAt({-1.0, -5.0}).has_value());
    }
  }
}

Camera downwards(double height) {
  return lookAt({128.0, -128.0, height}, {128.0, -128.0, 0.0}, 0.6, 64, 48);
}

/// The places that the camera sees on a plane.
std::vector<glm::dvec3> placesOnPlane(const Camera& camera, double height) {
  std::vector<glm::dvec3> out;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const glm::dvec3 ray = camera.rayThroughPixel({x + 0.5, y + 0.5});
      out.push_back(camera.eyeLocal + ray * ((height - camera.eyeLocal.z) / ray.z));
    }
  }
  out[0] = glm::dvec3(std::numeric_limits<double>::quiet_NaN());
  return out;
}

TEST(MeasurePops, CountsWhatMovesAndNothingElse) {
  const Frame frame;
  const OneTile flat([](int, int) { return 10.0F; });
  const OneTile raised([](int x, int) { return x > 128 ? 11.0F : 10.0F; });
  const Cut cut = fullCut({.k = 3}, 4, 1.0F);
  const DrawnSurface before(cut, frame, raised), now(cut, frame, flat);
  const Camera last = downwards(200.0), camera = downwards(190.0);
  const auto places = placesOnPlane(camera, 10.0);

  const PopMeasure still = measurePops({last, now}, {camera, now}, places);
  EXPECT_EQ(still.maxPixels, 0.0);
  EXPECT_EQ(still.pixels, 64 * 48 - 1);
  EXPECT_LT(still.offSurface, 1e-9);

  // One metre of height moves a point away from the picture's middle, by its distance from there over the
  // depth.
  const PopMeasure pops = measurePops({last, before}, {camera, now}, places);
  const double farthest = std::hypot(31.5, 23.5) / 179.0;
  EXPECT_NEAR(pops.maxPixels, farthest, 0.05 * farthest);
  EXPECT_GT(pops.maxPoint.x, 128.0);
  EXPECT_EQ(pops.aboveHalf, 0);

  // What was out of the window, or behind it, is not seen to pop; what was in it and not drawn is told.
  const Camera aside = lookAt({128.0, -128.0, 200.0}, {2000.0, -128.0, 200.0}, 0.6, 64, 48);
  EXPECT_EQ(measurePops({aside, before}, {camera, now}, places).pixels, 0);
  Cut half = cut;
  half.patches.resize(cut.patches.size() / 2);
  const DrawnSurface partly(half, frame, flat);
  EXPECT_GT(measurePops({last, partly}, {camera, now}, places).missing, 0);
}

}  // namespace
}  // namespace terrane
