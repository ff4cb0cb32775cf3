#include "line_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <random>

namespace terrane {
namespace {

double distanceTo(const std::vector<glm::dvec2>& corners, glm::dvec2 p) {
  double out = 1e300;
  for (size_t i = 0; i < corners.size(); ++i) {
    const glm::dvec2 a = corners[i], b = corners[std::min(i + 1, corners.size() - 1)];
    const glm::dvec2 along = b - a;
    const double square = glm::dot(along, along);
    const double t = square > 0.0 ? std::clamp(glm::dot(p - a, along) / square, 0.0, 1.0) : 0.0;
    out = std::min(out, glm::length(p - a - t * along));
  }
  return out;
}

std::vector<GroundLine> randomLines(std::mt19937& random, int count, double spread) {
  std::uniform_real_distribution<double> place(-spread, spread), step(-0.02 * spread, 0.02 * spread);
  std::vector<GroundLine> out;
  for (int i = 0; i < count; ++i) {
    GroundLine line;
    glm::dvec2 at(3e5 + place(random), -2e5 + place(random));
    const int corners = 1 + static_cast<int>(random() % 40);
    for (int k = 0; k < corners; ++k) {
      line.corners.push_back(at);
      // Some are straight, some wind, some have corners that are hardly apart.
      at += (k % 5 == 0 ? 20.0 : k % 3 == 0 ? 0.01 : 1.0) * glm::dvec2(step(random), step(random));
    }
    line.isWidthInMeters = i % 3 == 0;
    line.width = line.isWidthInMeters ? 1.0 + static_cast<double>(random() % 60) : 3.0;
    out.push_back(line);
  }
  return out;
}

/// What a cell's list says of each line is true: as near as it is, wherever it matters.
TEST(LineGrid, EveryCellKnowsWhatIsNear) {
  for (uint32_t seed = 1; seed <= 6; ++seed) {
    std::mt19937 random(seed);
    const double spread = std::pow(10.0, 1.0 + 0.6 * seed);
    const auto lines = randomLines(random, 60, spread);
    const LineGrid grid = makeLineGrid(lines);
    ASSERT_GT(grid.levels, 0);
    std::uniform_real_distribution<double> beside(-1.0, 1.0);
    int found = 0;
    for (int i = 0; i < 6000; ++i) {
      const int level = static_cast<int>(random() % static_cast<uint32_t>(grid.levels));
      const double cell = grid.cellMeters(level);
      const auto& near = lines[random() % lines.size()].corners;
      const glm::dvec2 p = near[random() % near.size()] + cell * glm::dvec2(beside(random), beside(random));
      const auto col = static_cast<int32_t>(std::floor(p.x / cell)),
                 row = static_cast<int32_t>(std::floor(p.y / cell));
      const glm::dvec2 middle((col + 0.5) * cell, (row + 0.5) * cell);
      const double quantum = grid.quantumMeters(level);
      std::map<int, double> listed;
      int32_t before = 1 << 30;
      for (const LineEntry& entry : grid.find(col, row, level)) {
        ASSERT_LE(entry[2], before) << "later lines come first";
        before = entry[2];
        const auto end = [&](int32_t bits) {
          return middle + quantum * glm::dvec2(static_cast<int16_t>(bits & 0xffff), bits >> 16);
        };
        const auto at = listed.emplace(entry[2], 1e300).first;
        at->second = std::min(at->second, distanceTo({end(entry[0]), end(entry[1])}, p));
      }
      const double tolerance = cell / 512.0 + 2.0 * quantum;
      for (size_t k = 0; k < lines.size(); ++k) {
        const double exact = distanceTo(lines[k].corners, p);
        const double reach = 0.5 * cell + (lines[k].isWidthInMeters ? 0.5 * lines[k].width : 0.0);
        const auto at = listed.find(static_cast<int>(k));
        const double told = at == listed.end() ? 1e300 : at->second;
        if (exact < reach - tolerance) {
          ASSERT_NEAR(told, exact, tolerance) << "seed " << seed << " level " << level;
          ++found;
        } else {
          ASSERT_GT(told, exact - tolerance);
        }
      }
    }
    EXPECT_GT(found, 3000) << seed;
  }
}

TEST(LineGrid, TakesWhatIsNoLine) {
  EXPECT_EQ(makeLineGrid({}).levels, 0);
  std::vector<GroundLine> lines(3);
  lines[1].corners = {{std::nan(""), 0.0}, {1e308 * 10.0, 2.0}};
  EXPECT_EQ(makeLineGrid(lines).levels, 0);
  lines[2].corners = {{5.0, 5.0}, {5.0, 5.0}, {5.0, 5.0}};
  const LineGrid grid = makeLineGrid(lines);
  ASSERT_GT(grid.levels, 0);
  ASSERT_FALSE(grid.find(0, 0, 0).empty());
  EXPECT_EQ(grid.find(0, 0, 0)[0][2], 2);
  EXPECT_TRUE(grid.find(1000, 0, 0).empty());
}

TEST(LineGrid, ThousandsOfSegmentsTakeAMomentAndSomeMegabytes) {
  std::mt19937 random(9);
  const auto lines = randomLines(random, 1000, 50000.0);
  size_t segments = 0;
  for (const GroundLine& line : lines) segments += line.corners.size() - 1;
  const auto begun = std::chrono::steady_clock::now();
  const LineGrid grid = makeLineGrid(lines);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  std::printf("%zu segments: %.1f ms, %zu entries, %zu slots\n", segments, 1e3 * seconds, grid.entries.size(),
              grid.slots.size());
  EXPECT_GT(segments, 15000U);
  EXPECT_LT((grid.entries.size() + grid.slots.size()) * 16, size_t{24} << 20);
}

}  // namespace
}  // namespace terrane
