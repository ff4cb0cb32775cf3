#include "imagery_selection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <random>
#include <set>

#include "terrane/codec/imagery_codec.h"

namespace terrane {
namespace {

/// No elevation is here: the ground may be anywhere in the dataset's range.
struct NoTiles final : ResidentTiles {
  const Tile* find(TileId) const override { return nullptr; }
};

/// A flat world, 41 km wide, with pictures everywhere down to the finest level.
Manifest flatWorld() {
  Manifest out;
  out.frame.finestLevel = 4;
  out.frame.spacingX = out.frame.spacingY = 10.0;
  return out;
}

Camera randomCamera(std::mt19937& random, double side) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const glm::dvec3 eye(unit(random) * side, -unit(random) * side,
                       50.0 + 6000.0 * unit(random) * unit(random));
  return lookAt(eye, {unit(random) * side, -unit(random) * side, 0.0}, 0.4 + unit(random), 640, 360);
}

std::set<TileId> chosenTiles(const Manifest& manifest, const Camera& camera, size_t most) {
  const NoTiles heights;
  std::set<TileId> out;
  for (const ImageryNeed& need : selectImagery(
           {camera, 1.0, manifest, heights, [&](TileId id) { return id.level < manifest.frame.finestLevel; }},
           most))
    EXPECT_TRUE(out.insert(need.tile).second) << toString(need.tile) << " twice";
  return out;
}

double texelMeters(const Frame& frame, TileId id) {
  return frame.spacingXMeters() * std::exp2(frame.finestLevel - id.level);
}

/// The distance from the eye to the nearest point of a tile of flat ground.
double distanceTo(const Frame& frame, TileId id, glm::dvec3 eye) {
  const double side = texelMeters(frame, id) * kImageryTileSide;
  const glm::dvec3 low(id.col * side, -(id.row + 1) * side, 0.0),
      high((id.col + 1) * side, -id.row * side, 0.0);
  return glm::distance(eye, glm::clamp(eye, low, high));
}

TEST(ImagerySelection, EveryPixelHasATexelThatIsNoLarger) {
  const Manifest manifest = flatWorld();
  const Frame& frame = manifest.frame;
  const double side = texelMeters(frame, TileId{}) * kImageryTileSide;
  std::mt19937 random(4);
  size_t looked = 0;
  for (int view = 0; view < 40; ++view) {
    const Camera camera = randomCamera(random, side);
    const std::set<TileId> chosen = chosenTiles(manifest, camera, 100000);
    for (int y = 2; y < camera.height; y += 5) {
      for (int x = 2; x < camera.width; x += 5) {
        const glm::dvec3 ray = camera.rayThroughPixel({x, y});
        if (ray.z >= -1e-6) continue;
        const glm::dvec3 ground = camera.eyeLocal + ray * (-camera.eyeLocal.z / ray.z);
        if (ground.x < 0.0 || ground.x >= side || ground.y > 0.0 || ground.y <= -side) continue;
        // From the root down to the first level whose texels are small enough here.
        const double pixels = camera.pixelsPerTangent() / glm::distance(ground, camera.eyeLocal);
        for (int level = 0; level <= frame.finestLevel; ++level) {
          TileId id{level, 0, 0};
          const double tileSide = texelMeters(frame, id) * kImageryTileSide;
          id.col = static_cast<int>(ground.x / tileSide);
          id.row = static_cast<int>(-ground.y / tileSide);
          ASSERT_EQ(chosen.count(id), 1U) << toString(id) << " in view " << view;
          if (texelMeters(frame, id) * pixels <= 1.0) break;
        }
        ++looked;
      }
    }
  }
  EXPECT_GT(looked, 100000U);
}

TEST(ImagerySelection, AQuadrantsOwnDistanceAndViewDecideOverIt) {
  const Manifest manifest = flatWorld();
  const Frame& frame = manifest.frame;
  const double side = texelMeters(frame, TileId{}) * kImageryTileSide;
  std::mt19937 random(5);
  size_t chosenInAll = 0, leftOut = 0;
  for (int view = 0; view < 60; ++view) {
    const Camera camera = randomCamera(random, side);
    const std::set<TileId> chosen = chosenTiles(manifest, camera, 100000);
    const auto texelPixels = [&](TileId id) {
      return texelMeters(frame, id) * camera.pixelsPerTangent() / distanceTo(frame, id, camera.eyeLocal);
    };
    for (const TileId id : chosen) {
      if (id.isRoot()) continue;
      ++chosenInAll;
      EXPECT_EQ(chosen.count(id.parent()), 1U) << toString(id) << " without its parent";
      // Over its own ground texels as large as its parent's would be larger than a pixel.
      EXPECT_GT(2.0 * texelPixels(id), 1.0) << toString(id);
      // Not all of it is behind the camera.
      const double tileSide = texelMeters(frame, id) * kImageryTileSide;
      double farthest = -1.0;
      for (int corner = 0; corner < 4; ++corner)
        farthest = std::max(farthest, camera
                                          .viewFromLocal({(id.col + (corner & 1)) * tileSide,
                                                          -(id.row + (corner >> 1)) * tileSide, 0.0})
                                          .z);
      EXPECT_GE(farthest, 0.0) << toString(id) << " behind the camera";
      // Of its siblings those are left out that are far enough or out of view.
      for (int quadrant = 0; quadrant < 4; ++quadrant)
        leftOut += 1 - chosen.count(id.parent().child(quadrant));
    }
  }
  EXPECT_GT(chosenInAll, 1000U);
  EXPECT_GT(leftOut, 500U);
}

TEST(ImagerySelection, TexelsGrowWhereThereWouldBeTooMany) {
  const Manifest manifest = flatWorld();
  const double side = texelMeters(manifest.frame, TileId{}) * kImageryTileSide;
  const Camera camera =
      lookAt({0.4 * side, -0.9 * side, 300.0}, {0.5 * side, -0.1 * side, 0.0}, 0.9, 640, 360);
  const std::set<TileId> all = chosenTiles(manifest, camera, 100000);
  ASSERT_GT(all.size(), 20U);
  for (const size_t most : {size_t{20}, size_t{5}, size_t{1}}) {
    const std::set<TileId> fewer = chosenTiles(manifest, camera, most);
    EXPECT_LE(fewer.size(), most);
    EXPECT_EQ(fewer.count(TileId{}), 1U);
    for (const TileId id : fewer) EXPECT_EQ(all.count(id), 1U) << toString(id);
  }
}

}  // namespace
}  // namespace terrane
