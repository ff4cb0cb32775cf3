#include "terrane/reference/reference_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

namespace terrane {
namespace {

ReferenceGrid randomGrid(std::mt19937& random, double voidShare) {
  ReferenceGrid grid;
  grid.cols = 2 + random() % 14;
  grid.rows = 2 + random() % 14;
  grid.spacingX = 3.0;
  grid.spacingY = 2.0;
  std::uniform_real_distribution<float> height(-5.0F, 5.0F);
  for (int64_t i = 0; i < grid.cols * grid.rows; ++i) grid.heights.push_back(height(random));
  grid.groundCells.assign(static_cast<size_t>(((grid.cols - 1) * (grid.rows - 1) + 7) / 8), 0);
  std::bernoulli_distribution isVoid(voidShare);
  for (int64_t j = 0; j < grid.rows - 1; ++j) {
    for (int64_t i = 0; i < grid.cols - 1; ++i) {
      if (!isVoid(random)) grid.setGround(i, j);
    }
  }
  return grid;
}

glm::dvec3 vertex(const ReferenceGrid& grid, int64_t i, int64_t j) {
  return {static_cast<double>(i) * grid.spacingX, -static_cast<double>(j) * grid.spacingY, grid.height(i, j)};
}

struct Corners {
  glm::dvec3 a, b, c;
};

/// All triangles, written down by hand from the statement of the convention.
std::vector<Corners> allTriangles(const ReferenceGrid& grid) {
  std::vector<Corners> triangles;
  for (int64_t j = 0; j < grid.rows - 1; ++j) {
    for (int64_t i = 0; i < grid.cols - 1; ++i) {
      if (!grid.isGround(i, j)) continue;
      const glm::dvec3 nw = vertex(grid, i, j);
      const glm::dvec3 ne = vertex(grid, i + 1, j);
      const glm::dvec3 sw = vertex(grid, i, j + 1);
      const glm::dvec3 se = vertex(grid, i + 1, j + 1);
      if ((i + j) % 2 == 0) {
        triangles.push_back({nw, se, ne});
        triangles.push_back({nw, sw, se});
      } else {
        triangles.push_back({ne, nw, sw});
        triangles.push_back({ne, sw, se});
      }
    }
  }
  return triangles;
}

/// Distance to the nearest triangle, each made larger by `edge` (in barycentric coordinates); infinite: none.
double nearest(const std::vector<Corners>& triangles, glm::dvec3 origin, glm::dvec3 direction, double edge) {
  double best = INFINITY;
  for (const Corners& t : triangles) {
    const glm::dvec3 e1 = t.b - t.a;
    const glm::dvec3 e2 = t.c - t.a;
    const glm::dvec3 p = glm::cross(direction, e2);
    const double determinant = glm::dot(e1, p);
    if (determinant == 0.0) continue;
    const glm::dvec3 s = origin - t.a;
    const double u = glm::dot(s, p) / determinant;
    const glm::dvec3 q = glm::cross(s, e1);
    const double v = glm::dot(direction, q) / determinant;
    const double distance = glm::dot(e2, q) / determinant;
    if (u >= -edge && v >= -edge && u + v <= 1.0 + edge && distance >= 0.0) best = std::min(best, distance);
  }
  return best;
}

TEST(ReferenceSurface, MeetsWhatAllTrianglesMeet) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  int hits = 0;
  int compared = 0;
  for (int seed = 0; seed < 120; ++seed) {
    const ReferenceGrid grid = randomGrid(random, seed % 3 == 0 ? 0.3 : 0.0);
    const auto triangles = allTriangles(grid);
    const ReferenceSurface surface(grid);
    const double width = static_cast<double>(grid.cols) * grid.spacingX;
    const double height = static_cast<double>(grid.rows) * grid.spacingY;
    for (int i = 0; i < 300; ++i) {
      const glm::dvec3 target(width * (0.5 + 0.6 * unit(random)), -height * (0.5 + 0.6 * unit(random)),
                              5.0 * unit(random));
      glm::dvec3 direction(unit(random), unit(random), unit(random));
      // Grazing, upright and axis-parallel rays too.
      if (i % 5 == 1) direction.z *= 1e-3;
      if (i % 5 == 2) direction = {0.0, 0.0, i % 2 == 0 ? 1.0 : -1.0};
      if (i % 5 == 3) direction.x = 0.0;
      if (i % 5 == 4) direction.y = 0.0;
      const glm::dvec3 origin = target - (i % 7 == 0 ? 0.0 : 40.0) * direction;
      const double loose = nearest(triangles, origin, direction, 1e-6);
      const double strict = nearest(triangles, origin, direction, -1e-6);
      const auto hit = surface.cast(origin, direction);
      // Rays that pass within a millionth of an edge may go either way.
      if (std::abs(loose - strict) > 1e-9 * (1.0 + loose)) continue;
      ++compared;
      ASSERT_EQ(hit.has_value(), std::isfinite(strict)) << "seed " << seed << " ray " << i;
      if (!hit) continue;
      ++hits;
      EXPECT_NEAR(hit->distance, strict, 1e-8 * (1.0 + strict));
      const auto ground = surface.heightAt({hit->point.x, hit->point.y});
      ASSERT_TRUE(ground.has_value());
      EXPECT_NEAR(*ground, hit->point.z, 1e-6);
    }
  }
  EXPECT_GT(compared, 30000);
  EXPECT_GT(hits, 5000);
}

TEST(ReferenceSurface, LetsNoRayThroughEdgesAndVertices) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int seed = 0; seed < 60; ++seed) {
    const ReferenceGrid grid = randomGrid(random, 0.0);
    const ReferenceSurface surface(grid);
    for (int ray = 0; ray < 200; ++ray) {
      // A place on an edge of the grid or on a vertex, from above and not along the surface.
      const auto i = static_cast<int64_t>(random() % static_cast<uint64_t>(grid.cols - 1));
      const auto j = static_cast<int64_t>(random() % static_cast<uint64_t>(grid.rows - 1));
      const glm::dvec3 ends[] = {vertex(grid, i + 1, j), vertex(grid, i, j + 1), vertex(grid, i, j)};
      const double share = ray % 3 == 0 ? 0.0 : 0.5 + 0.5 * unit(random);
      const glm::dvec3 target = glm::mix(vertex(grid, i, j), ends[random() % 3], share);
      const glm::dvec3 origin = ray % 4 == 0 ? target + glm::dvec3(0, 0, 30)
                                             : target + glm::dvec3(2 * unit(random), 2 * unit(random), 30);
      const auto hit = surface.cast(origin, target - origin);
      ASSERT_TRUE(hit.has_value()) << "seed " << seed << " ray " << ray;
      EXPECT_LE(hit->distance, 1.0 + 1e-8);
      EXPECT_TRUE(hit->fromAbove);
    }
  }
}

TEST(ReferenceSurface, KnowsItsHeights) {
  std::mt19937 random(3);
  for (int seed = 0; seed < 50; ++seed) {
    const ReferenceGrid grid = randomGrid(random, 0.2);
    const auto triangles = allTriangles(grid);
    const ReferenceSurface surface(grid);
    std::uniform_real_distribution<double> x(-1.0, static_cast<double>(grid.cols) * grid.spacingX);
    std::uniform_real_distribution<double> y(-static_cast<double>(grid.rows) * grid.spacingY, 1.0);
    for (int i = 0; i < 200; ++i) {
      const glm::dvec2 place(x(random), y(random));
      const double distance = nearest(triangles, glm::dvec3(place, 50.0), {0, 0, -1}, 0.0);
      const auto height = surface.heightAt(place);
      ASSERT_EQ(height.has_value(), std::isfinite(distance));
      if (!height) continue;
      EXPECT_NEAR(*height, 50.0 - distance, 1e-9);
    }
  }
}

TEST(ReferenceSurface, CoverPromisesOnlyWhatEverySurfaceKeeps) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  int promises = 0;
  for (int seed = 0; seed < 60; ++seed) {
    ReferenceGrid grid = randomGrid(random, 0.0);
    // A single hole, so that promises remain.
    const int64_t hole =
        static_cast<int64_t>(random() % static_cast<uint64_t>((grid.cols - 1) * (grid.rows - 1)));
    grid.groundCells[static_cast<size_t>(hole >> 3)] &= static_cast<uint8_t>(~(1U << (hole & 7)));
    const ReferenceSurface surface(grid);
    const ReferenceSurface::Cover cover(surface, 1 + static_cast<int64_t>(random() % 2));

    // Another surface over the same ground with other heights in the same range.
    ReferenceGrid other = grid;
    std::uniform_real_distribution<double> within(surface.minHeight(), surface.maxHeight());
    for (float& height : other.heights) height = static_cast<float>(within(random));
    const ReferenceSurface another(other);
    for (int i = 0; i < 300; ++i) {
      const glm::dvec3 target(static_cast<double>(grid.cols) * grid.spacingX * (0.5 + 0.6 * unit(random)),
                              -static_cast<double>(grid.rows) * grid.spacingY * (0.5 + 0.6 * unit(random)),
                              0.0);
      const glm::dvec3 origin = target + glm::dvec3(20 * unit(random), 20 * unit(random), 30.0);
      if (!cover.mustHit(origin, target - origin)) continue;
      ++promises;
      EXPECT_TRUE(another.cast(origin, target - origin).has_value());
    }
  }
  EXPECT_GT(promises, 1000);
}

TEST(ReferenceSurface, MayHaveNoGround) {
  ReferenceGrid grid;
  grid.cols = 3;
  grid.rows = 2;
  grid.heights.assign(6, 1.0F);
  grid.groundCells.assign(1, 0);
  const ReferenceSurface surface(grid);
  EXPECT_FALSE(surface.hasGround());
  EXPECT_FALSE(surface.cast({1, -0.5, 9}, {0, 0, -1}).has_value());
  EXPECT_FALSE(surface.heightAt({1, -0.5}).has_value());
}

}  // namespace
}  // namespace terrane
