#include "horizon.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include <glm/geometric.hpp>
#include <random>
#include <vector>

namespace terrane {
namespace {

struct Line {
  glm::dvec2 from, to;
  std::vector<double> heights;
};

Camera someCamera(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  return lookAt({0.0, 0.0, 500.0}, {100.0 * unit(random), 100.0, 500.0 + 60.0 * unit(random)},
                0.8 + 0.4 * unit(random), 1280, 720);
}

/// What is hidden is below some line in its direction, or out of the picture; in many directions at once.
TEST(Horizon, HidesOnlyWhatIsBelowALine) {
  int64_t hidden = 0, seen = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const Camera camera = someCamera(random);
    Horizon horizon(camera);
    ASSERT_TRUE(horizon.isLevel());
    // Lines that meet end to end, and others; heights of sections.
    std::vector<Line> lines;
    glm::dvec2 last(-2000.0, 800.0);
    for (int i = 0; i < 60; ++i) {
      Line line;
      line.from =
          i % 3 == 0 ? glm::dvec2(4000.0 * unit(random) - 2000.0, 300.0 + 2000.0 * unit(random)) : last;
      line.to = line.from + glm::dvec2(400.0 * unit(random) - 100.0, 200.0 * unit(random) - 100.0);
      last = line.to;
      for (int j = 0; j < 1 + i % 4; ++j) line.heights.push_back(1000.0 * unit(random));
      std::vector<Horizon::Point> points;
      std::vector<float> heights;
      bool isAhead = true;
      for (size_t j = 0; j <= line.heights.size(); ++j) {
        const double share = static_cast<double>(j) / static_cast<double>(line.heights.size());
        const glm::dvec2 place = horizon.place(line.from + share * (line.to - line.from));
        isAhead &= place.y > 1.0;
        points.push_back({horizon.across(place.x, 1.0 / place.y), 1.0 / place.y});
        if (j > 0) heights.push_back(static_cast<float>(line.heights[j - 1] - camera.eyeLocal.z));
      }
      if (!isAhead) continue;
      horizon.raise(points, heights);
      lines.push_back(line);
    }
    for (int i = 0; i < 4000; ++i) {
      const double across = Horizon::kColumns * unit(random), width = 3.0 * unit(random) * unit(random);
      const double up = 2.0 * unit(random) - 1.2;
      if (!horizon.hides(across, across + width, up)) {
        ++seen;
        continue;
      }
      // Brute force, somewhere in between.
      const double at = across + width * unit(random);
      bool isBelow = false;
      for (const Line& line : lines) {
        const glm::dvec2 p = horizon.place(line.from), q = horizon.place(line.to);
        const double first = horizon.across(p.x, 1.0 / p.y), second = horizon.across(q.x, 1.0 / q.y);
        if ((at < first) == (at < second)) continue;
        // Straight lines stay straight: by how far along across, and from there along the ground.
        const double share = (at - first) / (second - first);
        const double oneOverAhead = 1.0 / p.y + share * (1.0 / q.y - 1.0 / p.y);
        const double along = share / q.y / oneOverAhead;
        const auto section = static_cast<size_t>(along * static_cast<double>(line.heights.size()));
        if (section >= line.heights.size()) continue;
        isBelow |= up < (line.heights[section] - camera.eyeLocal.z) * oneOverAhead;
      }
      // Or below the picture.
      const double right =
          (at - horizon.across(0.0, 1.0)) / (horizon.across(1.0, 1.0) - horizon.across(0.0, 1.0));
      const glm::dvec2 ahead = glm::normalize(glm::dvec2(camera.forward));
      const glm::dvec3 ray(ahead + right * glm::dvec2(ahead.y, -ahead.x), up);
      const glm::dvec3 view(glm::dot(ray, camera.right), glm::dot(ray, camera.up),
                            glm::dot(ray, camera.forward));
      const bool isInPicture = view.z > 0.0 && std::abs(view.x) <= view.z * camera.tanHalfX() &&
                               std::abs(view.y) <= view.z * camera.tanHalfY();
      ASSERT_TRUE(isBelow || !isInPicture) << "seed " << seed << ", across " << at << ", up " << up;
      if (isInPicture) ++hidden;
    }
  }
  EXPECT_GT(hidden, 5000);
  EXPECT_GT(seen, 5000);
}

/// Lines that meet hide as one: no gap where they do.
TEST(Horizon, LinesThatMeetLeaveNoGap) {
  const Camera camera = lookAt({0.0, 0.0, 500.0}, {0.0, 100.0, 500.0}, 0.9, 1280, 720);
  for (const bool isReverse : {false, true}) {
    Horizon horizon(camera);
    const auto pointAt = [&](double x) {
      return Horizon::Point{horizon.across(x, 1.0 / 1000.0), 1.0 / 1000.0};
    };
    for (int i = 0; i < 20; ++i) {
      const double from = -700.0 + 70.0 * (isReverse ? 19 - i : i);
      const std::array<Horizon::Point, 2> line = {pointAt(from), pointAt(from + 70.0)};
      horizon.raise(line, std::array<float, 1>{100.0F});
    }
    EXPECT_TRUE(horizon.hides(pointAt(-690.0).across, pointAt(690.0).across, 0.099));
    EXPECT_FALSE(horizon.hides(pointAt(-690.0).across, pointAt(690.0).across, 0.101));
    EXPECT_FALSE(horizon.hides(pointAt(690.0).across, pointAt(720.0).across, 0.099));
  }
}

/// Looking down there is none.
TEST(Horizon, NeedsALevelView) {
  EXPECT_FALSE(Horizon(lookAt({0, 0, 500}, {0, 1, 0}, 0.9, 1280, 720)).isLevel());
  EXPECT_FALSE(Horizon(lookAt({0, 0, 500}, {0, 300, 0}, 1.5, 1280, 720)).isLevel());
  EXPECT_TRUE(Horizon(lookAt({0, 0, 500}, {0, 3000, 0}, 1.5, 1280, 720)).isLevel());
}

}  // namespace
}  // namespace terrane
