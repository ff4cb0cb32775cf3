#include "significance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "function_source.h"
#include "terrane/tiling/lattice.h"

namespace terrane {
namespace {

constexpr auto kTileSize = static_cast<size_t>(kTileSampleCount);

/// A world of 2 x 2 tiles, with its samples in one array; and the same cut into tiles.
class TiledWorld {
 public:
  static constexpr int kCells = 2 * kTileCells;
  static constexpr int kSamples = kCells + 1;

  TiledWorld(const std::function<float(int, int)>& height, double maxError, double step)
      : maxError_(maxError), given_(size()), onStep_(size()) {
    for (int y = 0; y < kSamples; ++y) {
      for (int x = 0; x < kSamples; ++x) {
        given_[at(x, y)] = height(x, y);
        onStep_[at(x, y)] =
            static_cast<float>(step * std::round(static_cast<double>(given_[at(x, y)]) / step));
      }
    }
  }

  static size_t size() { return static_cast<size_t>(kSamples) * kSamples; }
  static size_t at(int x, int y) { return static_cast<size_t>(y * kSamples + x); }
  static size_t at(LatticePoint p) { return at(p.x, p.y); }
  bool hasHeight(LatticePoint p) const { return !std::isnan(given_[at(p)]); }
  bool hasHeight(size_t i) const { return !std::isnan(given_[i]); }
  const std::vector<float>& given() const { return given_; }
  const std::vector<float>& onStep() const { return onStep_; }

  std::vector<float> tileOf(const std::vector<float>& from, int tile) const {
    std::vector<float> out(kTileSize);
    for (int y = 0; y < kTileSamples; ++y) {
      for (int x = 0; x < kTileSamples; ++x) {
        out[static_cast<size_t>(y * kTileSamples + x)] =
            from[at(tile % 2 * kTileCells + x, tile / 2 * kTileCells + y)];
      }
    }
    return out;
  }

  /// What the functions under test make of it; tiles must agree on their borders.
  void run() {
    std::vector<std::vector<uint8_t>> needs(4, std::vector<uint8_t>(kSampleBitsBytes));
    for (int tile = 0; tile < 4; ++tile) {
      findNeeded(tileOf(given_, tile), tileOf(onStep_, tile), maxError_,
                 std::span<uint8_t, kSampleBitsBytes>(needs[static_cast<size_t>(tile)]));
    }
    significant_.assign(size(), 2);
    heights_.assign(size(), 0.0F);
    std::vector<uint8_t> significant(kTileSize);
    std::vector<SampleState> states(kTileSize);
    for (int tile = 0; tile < 4; ++tile) {
      NeedsAround around{};
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int col = tile % 2 + dx, row = tile / 2 + dy;
          if (col < 0 || col > 1 || row < 0 || row > 1) continue;
          around[static_cast<size_t>((dy + 1) * 3 + dx + 1)] =
              needs[static_cast<size_t>(row * 2 + col)].data();
        }
      }
      findSignificant(around, significant);
      std::vector<float> heights = tileOf(onStep_, tile);
      interpolateInsignificant(significant, heights, states);
      std::vector<float> again = heights;
      interpolateInsignificant(significant, again, states);
      for (int y = 0; y < kTileSamples; ++y) {
        for (int x = 0; x < kTileSamples; ++x) {
          const auto i = static_cast<size_t>(y * kTileSamples + x);
          const size_t there = at(tile % 2 * kTileCells + x, tile / 2 * kTileCells + y);
          if (significant_[there] != 2) {
            ASSERT_EQ(significant_[there], significant[i]) << x << " " << y;
            ASSERT_TRUE(heights_[there] == heights[i] || std::isnan(heights[i])) << x << " " << y;
          }
          ASSERT_TRUE(again[i] == heights[i] || (std::isnan(again[i]) && std::isnan(heights[i])));
          ASSERT_EQ(states[i], std::isnan(given_[there]) ? SampleState::Void
                               : significant[i] != 0     ? SampleState::Coded
                                                         : SampleState::Interpolated);
          significant_[there] = significant[i];
          heights_[there] = heights[i];
        }
      }
    }
  }

  const std::vector<uint8_t>& significant() const { return significant_; }
  const std::vector<float>& heights() const { return heights_; }

  /// Which samples are significant, from the definition: every triangle by itself, in doubles.
  std::vector<uint8_t> significantByDefinition(double maxError) const {
    const Lattice lattice(1);
    std::vector<uint8_t> out(size(), 0);
    // From small to large, so that a diamond's descendants come before it.
    for (int s = 1; s <= kLargestOptional; s *= 2) {
      for (const bool quads : {false, true}) {
        for (int y = 0; y < kSamples; y += s) {
          for (int x = 0; x < kSamples; x += s) {
            const bool oddX = (x / s) % 2 != 0, oddY = (y / s) % 2 != 0;
            if (quads ? !(oddX && oddY) : oddX == oddY) continue;
            const Diamond d = lattice.diamondAt({x, y});
            bool needed = out[at(x, y)] != 0;
            for (const LatticePoint& apex : lattice.apexes(d))
              needed = needed || isOff(lattice, d, apex, maxError);
            if (!needed) continue;
            out[at(x, y)] = 1;
            for (const Diamond& parent : lattice.parents(d)) {
              if (lattice.halfSize(parent.level) <= kLargestOptional) out[at(parent.center())] = 1;
            }
          }
        }
      }
    }
    for (int y = 0; y < kSamples; y += 2 * kLargestOptional) {
      for (int x = 0; x < kSamples; x += 2 * kLargestOptional) out[at(x, y)] = 1;
    }
    return out;
  }

 private:
  bool isOff(const Lattice& lattice, const Diamond& d, LatticePoint apex, double maxError) const {
    const auto ends = lattice.hypotenuse(d);
    const std::array<LatticePoint, 3> corners = {ends[0], ends[1], apex};
    const auto twice = [](LatticePoint a, LatticePoint b, LatticePoint c) {
      return (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    };
    const int area = twice(corners[0], corners[1], corners[2]);
    const auto [left, right] = std::minmax({corners[0].x, corners[1].x, corners[2].x});
    const auto [top, bottom] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        const LatticePoint p{x, y};
        if (!hasHeight(p) || p == corners[0] || p == corners[1] || p == corners[2]) continue;
        double plane = 0.0;
        bool inside = true;
        for (size_t i = 0; i < 3; ++i) {
          const double share =
              static_cast<double>(twice(p, corners[(i + 1) % 3], corners[(i + 2) % 3])) / area;
          inside = inside && share >= 0.0;
          if (share > 0.0) plane += share * static_cast<double>(onStep_[at(corners[i])]);
        }
        if (!inside) continue;
        if (!(std::abs(plane - static_cast<double>(given_[at(p)])) <= maxError)) return true;
      }
    }
    return false;
  }

  double maxError_;
  std::vector<float> given_;
  std::vector<float> onStep_;
  std::vector<uint8_t> significant_;
  std::vector<float> heights_;
};

/// Ground of many kinds, by seed: smooth, rough, cliffs and flats, and holes of every size in half of them.
float mixedGround(int x, int y, uint64_t seed) {
  const int kind = static_cast<int>(seed % 4);
  const double u = x, v = y;
  double height = 40.0 * std::sin(u / 60.0 + static_cast<double>(seed)) * std::cos(v / 45.0);
  if (kind == 1) height += 3.0 * noiseAt(x, y, seed);
  if (kind == 2) height = noiseAt(x / 37, y / 53, seed) < 0.5 ? 100.0 : 400.0 + 0.01 * u;
  if (kind == 3) height += noiseAt(x / 20, y / 20, seed) < 0.3 ? 6.0 * noiseAt(x, y, seed) : 0.0;
  if (seed % 8 >= 4) {
    if (noiseAt(x / 50, y / 70, seed + 1) < 0.2 || noiseAt(x / 3, y / 5, seed + 2) < 0.01) return kNone;
    if (noiseAt(x, y, seed + 3) < 0.0005 || x > 480) return kNone;
  }
  return static_cast<float>(1500.0 + height);
}

TEST(Significance, KeepsTheBoundIsClosedAndIsWhatItsDefinitionSays) {
  const Lattice lattice(1);
  size_t total = 0;
  for (uint64_t seed = 0; seed < 16; ++seed) {
    const double maxError = seed % 3 == 0 ? 0.25 : 2.0;
    const double step = seed % 2 == 0 ? 0.5 * maxError : 1.9 * maxError;
    TiledWorld world([&](int x, int y) { return mixedGround(x, y, seed); }, maxError, step);
    world.run();
    if (HasFatalFailure()) FAIL() << "seed " << seed;

    // note: floats round, so what leaves its triangle by almost exactly the bound may go either way.
    const auto most = world.significantByDefinition(maxError - 0.002);
    const auto least = world.significantByDefinition(maxError);
    size_t coded = 0;
    for (int y = 0; y < TiledWorld::kSamples; ++y) {
      for (int x = 0; x < TiledWorld::kSamples; ++x) {
        const size_t i = TiledWorld::at(x, y);
        const bool significant = world.significant()[i] != 0;
        ASSERT_GE(significant, least[i] != 0) << "seed " << seed << " at " << x << " " << y;
        ASSERT_LE(significant, most[i] != 0) << "seed " << seed << " at " << x << " " << y;
        coded += significant ? 1 : 0;
        const auto bits = static_cast<uint32_t>(x) | static_cast<uint32_t>(y);
        if (bits % (2 * kLargestOptional) == 0) {
          ASSERT_TRUE(significant);
        } else if (significant) {
          const Diamond d = lattice.diamondAt({x, y});
          for (const Diamond& parent : lattice.parents(d))
            ASSERT_TRUE(world.significant()[TiledWorld::at(parent.center())]) << "seed " << seed;
        }
        if (!world.hasHeight(i)) {
          ASSERT_TRUE(std::isnan(world.heights()[i]));
          continue;
        }
        ASSERT_LE(std::abs(static_cast<double>(world.heights()[i]) - static_cast<double>(world.given()[i])),
                  maxError)
            << "seed " << seed << " at " << x << " " << y;
        if (significant) {
          ASSERT_EQ(world.heights()[i], world.onStep()[i]);
          continue;
        }
        const auto ends = lattice.hypotenuse(lattice.diamondAt({x, y}));
        if (!world.hasHeight(ends[0]) || !world.hasHeight(ends[1])) continue;
        ASSERT_EQ(
            world.heights()[i],
            (world.heights()[TiledWorld::at(ends[0])] + world.heights()[TiledWorld::at(ends[1])]) * 0.5F);
      }
    }
    EXPECT_GE(coded, TiledWorld::size() / 256) << "seed " << seed;
    EXPECT_LT(coded, TiledWorld::size() * 95 / 100) << "seed " << seed;
    total += coded;
  }
  // Much is left out and much is kept, or the test would say little.
  EXPECT_GT(total, 16 * TiledWorld::size() / 5);
  EXPECT_LT(total, 16 * TiledWorld::size() * 4 / 5);
}

TEST(Significance, ABoundThatFloatsCannotTellKeepsEverything) {
  TiledWorld world([](int, int) { return 8000.0F; }, 0.001, 0.001);
  world.run();
  EXPECT_EQ(std::count(world.significant().begin(), world.significant().end(), 1),
            static_cast<ptrdiff_t>(TiledWorld::size()));
}

TEST(Significance, PlanesAndNothingCostNothing) {
  TiledWorld plane([](int x, int y) { return static_cast<float>(100 + 2 * x - y); }, 0.5, 1.0);
  plane.run();
  EXPECT_EQ(std::count(plane.significant().begin(), plane.significant().end(), 1), 33 * 33);
  TiledWorld nothing([](int, int) { return kNone; }, 0.5, 1.0);
  nothing.run();
  EXPECT_EQ(std::count(nothing.significant().begin(), nothing.significant().end(), 1), 33 * 33);
}

TEST(Significance, ASpikeBringsItsAncestorsAndNoMore) {
  // In the corner of a square: its ancestors lie in all four squares around.
  const auto spike = [](int x, int y) { return x == 255 && y == 257 ? 10.0F : 0.0F; };
  TiledWorld world(spike, 0.5, 0.5);
  world.run();
  const Lattice lattice(1);
  std::vector<uint8_t> expected = world.significantByDefinition(0.5);
  EXPECT_EQ(world.significant(), expected);
  bool south = false, north = false, east = false;
  for (int y = 0; y < TiledWorld::kSamples; ++y) {
    for (int x = 0; x < TiledWorld::kSamples; ++x) {
      if (world.significant()[TiledWorld::at(x, y)] == 0 || ((x | y) % 16) == 0) continue;
      ASSERT_LE(std::max(std::abs(x - 255), std::abs(y - 257)), 24);
      south |= y > 256;
      north |= y < 256;
      east |= x > 256;
    }
  }
  EXPECT_TRUE(south && north && east);
}

TEST(Significance, ThinDataAlongVoidIsKept) {
  // Lines one sample wide, a lone sample, a ring around a hole.
  const auto thin = [](int x, int y) {
    if (x == 40 || y == 129) return static_cast<float>(500.0 + 20.0 * std::sin(0.3 * (x + y)));
    if (x == 301 && y == 77) return 12.0F;
    const int dx = x - 400, dy = y - 400;
    return dx * dx + dy * dy < 3600 && dx * dx + dy * dy > 2500 ? static_cast<float>(dx) : kNone;
  };
  TiledWorld world(thin, 0.5, 0.25);
  world.run();
  for (size_t i = 0; i < TiledWorld::size(); ++i) {
    if (world.hasHeight(i)) {
      ASSERT_NEAR(world.heights()[i], world.given()[i], 0.5);
    } else {
      ASSERT_TRUE(std::isnan(world.heights()[i]));
    }
  }
}

}  // namespace
}  // namespace terrane
