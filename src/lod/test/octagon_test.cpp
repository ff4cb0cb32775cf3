#include "terrane/lod/octagon.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <random>

namespace terrane {
namespace {

bool inside(const Octagon& o, glm::dvec2 p, double slack) {
  return std::abs(p.x) <= o.extent + slack && std::abs(p.y) <= o.extent + slack &&
         std::abs(p.x) + std::abs(p.y) <= o.sum + slack;
}

TEST(Octagon, HoldsAllDescendantsOfADiamond) {
  const Lattice lattice(0);
  for (int deepest = 3; deepest <= 11; ++deepest) {
    const NestedOctagons octagons(lattice, deepest);
    for (int level = 0; level < deepest; ++level) {
      // One diamond far from the border of each level suffices: the lattice looks the same everywhere.
      const int32_t s = lattice.halfSize(level);
      const int32_t middle = lattice.side() / 2;
      Diamond d{middle, middle, level};
      if (level > 0)
        d = level % 2 == 0 ? Diamond{middle - s, middle - s, level} : Diamond{middle - s, middle, level};
      ASSERT_EQ(lattice.diamondAt(d.center()).level, level);
      std::vector<Diamond> all = {d};
      for (size_t i = 0; i < all.size(); ++i) {
        const Diamond at = all[i];
        for (const LatticePoint& p : lattice.apexes(at))
          EXPECT_TRUE(inside(octagons.nested(level), {p.x - d.x, p.y - d.y}, 1e-9));
        for (const LatticePoint& p : lattice.hypotenuse(at))
          EXPECT_TRUE(inside(octagons.nested(level), {p.x - d.x, p.y - d.y}, 1e-9));
        if (at.level < deepest && at.level < level + 6)
          for (const Diamond& c : lattice.children(at)) all.push_back(c);
      }
    }
  }
}

TEST(Octagon, ApproachesGerstnersConstants) {
  const NestedOctagons octagons(Lattice(0), 40);
  // In half-sizes s: quad-centre 3s and 4s (leg 2s), edge-centre 2s and 3s (hypotenuse 2s).
  EXPECT_NEAR(octagons.nested(0).extent, 3.0 * 128, 1e-2);
  EXPECT_NEAR(octagons.nested(0).sum, 4.0 * 128, 1e-2);
  EXPECT_NEAR(octagons.nested(1).extent, 2.0 * 128, 1e-2);
  EXPECT_NEAR(octagons.nested(1).sum, 3.0 * 128, 1e-2);
}

TEST(Octagon, DistanceAndSupportAgreeWithItsCorners) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 300; ++i) {
    const double extent = 1.0 + std::abs(unit(random));
    const Octagon o{extent, extent * (1.0 + std::abs(unit(random)))};
    const double a = o.extent, b = o.inner();
    const std::vector<glm::dvec2> corners = {{a, b},   {b, a},   {-b, a}, {-a, b},
                                             {-a, -b}, {-b, -a}, {b, -a}, {a, -b}};
    const glm::dvec2 n(unit(random), unit(random));
    double support = -1e9;
    for (const glm::dvec2& c : corners) support = std::max(support, glm::dot(n, c));
    EXPECT_NEAR(o.support(n), support, 1e-12);

    const glm::dvec2 p(4.0 * unit(random), 4.0 * unit(random));
    double nearest = 1e9;
    for (size_t c = 0; c < 8; ++c) {
      const glm::dvec2 from = corners[c], to = corners[(c + 1) % 8];
      const double length = glm::dot(to - from, to - from);
      const double t = length > 0.0 ? std::clamp(glm::dot(p - from, to - from) / length, 0.0, 1.0) : 0.0;
      nearest = std::min(nearest, glm::length(p - from - t * (to - from)));
    }
    if (inside(o, p, 0.0)) nearest = 0.0;
    EXPECT_NEAR(o.distance(p), nearest, 1e-9);
  }
}

}  // namespace
}  // namespace terrane
