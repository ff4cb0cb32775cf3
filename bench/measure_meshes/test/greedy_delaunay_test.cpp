#include "greedy_delaunay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>

namespace terrane {
namespace {

constexpr int kSide = 33;

std::vector<float> roughHeights(uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> noise(-1.0F, 1.0F);
  std::vector<float> heights;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const float wave = std::sin(static_cast<float>(x) * 0.31F) * std::cos(static_cast<float>(y) * 0.17F);
      heights.push_back(20.0F * wave + noise(random));
    }
  }
  return heights;
}

struct Place {
  int64_t x, y;  ///< y to the north
};
Place placeOf(uint32_t sample) {
  return {sample % kSide, -int64_t{sample / kSide}};
}
int64_t twiceArea(Place a, Place b, Place c) {
  return (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
}

/// Is d strictly within the circle through a, b and c (counter-clockwise)? Exact.
bool isInCircle(Place a, Place b, Place c, Place d) {
  const auto row = [&](Place p) {
    const int64_t x = p.x - d.x;
    const int64_t y = p.y - d.y;
    return std::array<int64_t, 3>{x, y, x * x + y * y};
  };
  const auto [ax, ay, aa] = row(a);
  const auto [bx, by, bb] = row(b);
  const auto [cx, cy, cc] = row(c);
  return ax * (by * cc - cy * bb) - ay * (bx * cc - cx * bb) + aa * (bx * cy - cx * by) > 0;
}

/// The largest distance of a sample from the triangles that hold it; each sample must be in one.
double largestError(const std::vector<float>& heights, const std::vector<GreedyTriangle>& triangles) {
  double largest = 0.0;
  for (uint32_t sample = 0; sample < heights.size(); ++sample) {
    const Place p = placeOf(sample);
    bool found = false;
    for (const GreedyTriangle& triangle : triangles) {
      const Place a = placeOf(triangle[0]);
      const Place b = placeOf(triangle[1]);
      const Place c = placeOf(triangle[2]);
      const int64_t u = twiceArea(p, b, c);
      const int64_t v = twiceArea(a, p, c);
      const int64_t w = twiceArea(a, b, p);
      if (u < 0 || v < 0 || w < 0) continue;
      found = true;
      const double height =
          (static_cast<double>(u) * heights[triangle[0]] + static_cast<double>(v) * heights[triangle[1]] +
           static_cast<double>(w) * heights[triangle[2]]) /
          static_cast<double>(u + v + w);
      largest = std::max(largest, std::abs(height - heights[sample]));
    }
    EXPECT_TRUE(found) << sample;
  }
  return largest;
}

TEST(GreedyDelaunay, KeepsTheBoundWithDelaunayTriangles) {
  size_t before = 0;
  for (const double bound : {30.0, 6.0, 2.0, 0.7, 0.2, 0.0}) {
    const std::vector<float> heights = roughHeights(static_cast<uint32_t>(bound * 10.0));
    const auto triangles = greedyDelaunay(heights, kSide, bound);
    EXPECT_LE(largestError(heights, triangles), bound + 1e-9);
    EXPECT_GE(triangles.size(), before);
    before = triangles.size();

    // They cover the grid once, and no corner lies within another one's circle.
    std::set<uint32_t> corners;
    int64_t area = 0;
    for (const GreedyTriangle& t : triangles) {
      const int64_t one = twiceArea(placeOf(t[0]), placeOf(t[1]), placeOf(t[2]));
      ASSERT_GT(one, 0);
      area += one;
      corners.insert(t.begin(), t.end());
    }
    EXPECT_EQ(area, 2 * (kSide - 1) * (kSide - 1));
    for (const GreedyTriangle& t : triangles) {
      for (const uint32_t corner : corners)
        ASSERT_FALSE(isInCircle(placeOf(t[0]), placeOf(t[1]), placeOf(t[2]), placeOf(corner)));
    }
  }
  EXPECT_EQ(before, 2U * (kSide - 1) * (kSide - 1));
}

TEST(GreedyDelaunay, TakesTheWorstSampleFirst) {
  // A plane with two spikes: four corners and the spikes alone are needed for the larger bound.
  std::vector<float> heights;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) heights.push_back(static_cast<float>(2 * x - y));
  }
  EXPECT_EQ(greedyDelaunay(heights, kSide, 0.01).size(), 2U);
  heights[10 * kSide + 7] += 50.0F;
  const auto triangles = greedyDelaunay(heights, kSide, 49.0);
  EXPECT_EQ(triangles.size(), 4U);
  for (const GreedyTriangle& t : triangles)
    EXPECT_EQ(std::count(t.begin(), t.end(), uint32_t{10 * kSide + 7}), 1);
}

TEST(GreedyDelaunay, ForgetsWhatAnotherVertexHasMended) {
  // Both peaks are too far off at first, one in each triangle; with the higher one the other is near enough.
  std::vector<float> heights(size_t{kSide} * kSide, 0.0F);
  const int middle = kSide / 2;
  heights[static_cast<size_t>(middle * kSide + middle - 1)] = 51.0F;
  heights[static_cast<size_t>(middle * kSide + middle + 1)] = 50.0F;
  EXPECT_EQ(greedyDelaunay(heights, kSide, 49.0).size(), 4U);
}

}  // namespace
}  // namespace terrane
