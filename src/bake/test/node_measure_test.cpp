#include "node_measure.h"

#include <gtest/gtest.h>

#include <map>
#include <tuple>

#include "function_source.h"
#include "pyramid_steps.h"
#include "terrane/tiling/node_layout.h"

// The errors, ranges and codes of nodes against brute force: every finest ground sample against the patch's
// surface, evaluated by barycentric coordinates of the triangle that it is in.
namespace terrane {
namespace {

constexpr double kMaxError = 0.05;

/// A pyramid as a build makes it, with the samples at hand.
struct MadePyramid {
  explicit MadePyramid(const FunctionSource& source)
      : finest(source.plan().frame.finestLevel), pyramid(finest, scratch()) {
    const Workers workers(2, nullptr);
    SilentProgress progress;
    Jobs jobs(workers, nullptr);
    RankStores rankStores(scratch());
    RankStores* ranks = source.nativeLevels().size() > 1 ? &rankStores : nullptr;
    scale.heightStep = source.plan().heightStep;
    scale.errorUnit = scale.heightStep / 64.0;
    scale.rangeBase = -1000.0;
    scale.rangeUnit = 0.1;
    const auto raw = readRawTiles(source, scale, pyramid, ranks, nullptr, jobs, progress);
    EXPECT_TRUE(raw.ok());
    EXPECT_TRUE(fillTiles(source, pyramid, ranks, 1000.0F, jobs, progress).ok());
    EXPECT_TRUE(coverTiles(pyramid, scratch(), jobs).ok());
    EXPECT_TRUE(pruneTiles(pyramid, jobs).ok());
    NodeStores stores(scratch());
    EXPECT_TRUE(measureNodes(pyramid, stores, jobs, progress).ok());
    EXPECT_TRUE(saturateNodes(pyramid, stores, scale, kMaxError, jobs).ok());
    EXPECT_TRUE(takeNodes(pyramid, stores).ok());
    for (const auto& level : pyramid.levels) {
      for (const PyramidTile& tile : level) {
        if (!tile.stored) continue;
        EXPECT_TRUE(pyramid.readSamples(tile, samples[tile.id]).ok());
        for (const float height : samples[tile.id].heights) largest = std::max(largest, std::abs(height));
        const bool refined = std::all_of(tile.children.begin(), tile.children.end(), [&](int32_t child) {
          return child >= 0 &&
                 pyramid.levels[static_cast<size_t>(tile.id.level) + 1][static_cast<size_t>(child)].stored;
        });
        if (!refined) leaves.push_back(tile.id);
      }
    }
  }

  static Scratch scratch() { return {::testing::TempDir(), false}; }

  int finest;
  ElevationScale scale;
  Pyramid pyramid;
  std::map<TileId, TileSamples> samples;
  std::vector<TileId> leaves;  ///< stored tiles with a quadrant that nothing stored refines
  float largest = 0.0F;
};

/// The surface of all patches of a bintree level, in one tile that holds their samples. Coordinates are in
/// cells of the finest level.
class PatchSurface {
 public:
  PatchSurface(const MadePyramid& made, TileId tile, int bintreeLevel)
      : samples_(made.samples.at(tile)),
        cell_(int64_t{1} << (made.finest - tile.level)),
        originX_(int64_t{tile.col} * kTileCells * cell_),
        originY_(int64_t{tile.row} * kTileCells * cell_),
        quincunx_(bintreeLevel % 2 != 0) {
    // K = 17: sixteen cells along a leg, or thirty-two along a hypotenuse of which every second is a vertex.
    const int64_t halfSize = Lattice(made.finest).halfSize(bintreeLevel);
    square_ = 2 * halfSize / kNodeGrid.cellsPerSide();
  }

  double at(int64_t x, int64_t y) const {
    const int64_t squares = kTileCells * cell_ / square_;
    const int64_t col = std::min((x - originX_) / square_, squares - 1);
    const int64_t row = std::min((y - originY_) / square_, squares - 1);
    const int64_t left = originX_ + col * square_;
    const int64_t top = originY_ + row * square_;
    const double u = static_cast<double>(x - left) / static_cast<double>(square_);
    const double v = static_cast<double>(y - top) / static_cast<double>(square_);
    const double nw = height(left, top);
    const double ne = height(left + square_, top);
    const double sw = height(left, top + square_);
    const double se = height(left + square_, top + square_);
    if (quincunx_) {
      // Four triangles around the square's centre.
      const double center = height(left + square_ / 2, top + square_ / 2);
      const double w = 2.0 * std::min({u, v, 1.0 - u, 1.0 - v});
      double a = nw;
      double b = ne;
      double along = u;
      const double nearest = std::min({u, v, 1.0 - u, 1.0 - v});
      if (nearest == v) {
      } else if (nearest == u) {
        b = sw;
        along = v;
      } else if (nearest == 1.0 - v) {
        a = sw;
        b = se;
      } else {
        a = ne;
        b = se;
        along = v;
      }
      const double ofB = along - 0.5 * w;
      return w * center + ofB * b + (1.0 - w - ofB) * a;
    }
    // Two triangles; the diagonals alternate over the whole world.
    if (((left / square_ + top / square_) & 1) == 0) {
      return u >= v ? nw * (1.0 - u) + ne * (u - v) + se * v : nw * (1.0 - v) + sw * (v - u) + se * u;
    }
    return u + v <= 1.0 ? nw * (1.0 - u - v) + ne * u + sw * v
                        : se * (u + v - 1.0) + ne * (1.0 - v) + sw * (1.0 - u);
  }

 private:
  double height(int64_t x, int64_t y) const {
    const int64_t col = (x - originX_) / cell_;
    const int64_t row = (y - originY_) / cell_;
    EXPECT_EQ(originX_ + col * cell_, x);
    return static_cast<double>(samples_.heights[static_cast<size_t>(row * kTileSamples + col)]);
  }

  const TileSamples& samples_;
  int64_t cell_;
  int64_t originX_;
  int64_t originY_;
  bool quincunx_;
  int64_t square_;
};

bool inTriangle(LatticePoint a, LatticePoint b, LatticePoint c, int64_t x, int64_t y) {
  const auto side = [&](LatticePoint p, LatticePoint q) {
    const int64_t value = (int64_t{q.x} - p.x) * (y - p.y) - (int64_t{q.y} - p.y) * (x - p.x);
    return value > 0 ? 1 : value < 0 ? -1 : 0;
  };
  const int s0 = side(a, b);
  const int s1 = side(b, c);
  const int s2 = side(c, a);
  return (s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0);
}

struct Truth {
  double error = 0.0;
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};

/// What a node's triangles in one tile get wrong.
Truth measureByForce(const MadePyramid& made, TileId tile, const Diamond& diamond) {
  const Lattice lattice(made.finest);
  const PatchSurface surface(made, tile, diamond.level);
  const auto ends = lattice.hypotenuse(diamond);
  const int64_t tileSide = int64_t{kTileCells} << (made.finest - tile.level);
  Truth truth;
  for (const LatticePoint& apex : lattice.apexes(diamond)) {
    const auto inside = [&](int64_t value, int64_t tileAt) {
      return value >= tileAt * tileSide && value <= (tileAt + 1) * tileSide;
    };
    if (!inside(apex.x, tile.col) || !inside(apex.y, tile.row)) continue;
    const int64_t left = std::min({ends[0].x, ends[1].x, apex.x});
    const int64_t right = std::max({ends[0].x, ends[1].x, apex.x});
    const int64_t top = std::min({ends[0].y, ends[1].y, apex.y});
    const int64_t bottom = std::max({ends[0].y, ends[1].y, apex.y});
    for (const TileId leaf : made.leaves) {
      const TileSamples& samples = made.samples.at(leaf);
      const int64_t cell = int64_t{1} << (made.finest - leaf.level);
      const int64_t originX = int64_t{leaf.col} * kTileCells * cell;
      const int64_t originY = int64_t{leaf.row} * kTileCells * cell;
      // note: a finer tile that only touches the triangle has rounded means on the border, nothing new.
      const int64_t leafSide = kTileCells * cell;
      if (originX >= right || originY >= bottom || originX + leafSide <= left || originY + leafSide <= top)
        continue;
      const auto from = [&](int64_t edge, int64_t origin) {
        return std::max<int64_t>(0, (edge - origin + cell - 1) / cell);
      };
      const auto to = [&](int64_t edge, int64_t origin) {
        return edge < origin ? int64_t{-1} : std::min<int64_t>(kTileCells, (edge - origin) / cell);
      };
      for (int64_t row = from(top, originY); row <= to(bottom, originY); ++row) {
        for (int64_t col = from(left, originX); col <= to(right, originX); ++col) {
          const auto i = static_cast<size_t>(row * kTileSamples + col);
          const int64_t x = originX + col * cell;
          const int64_t y = originY + row * cell;
          if (samples.states[i] == SampleState::Void || !inTriangle(ends[0], ends[1], apex, x, y)) continue;
          const auto height = static_cast<double>(samples.heights[i]);
          truth.error = std::max(truth.error, std::abs(height - surface.at(x, y)));
          truth.low = std::min(truth.low, height);
          truth.high = std::max(truth.high, height);
        }
      }
    }
  }
  return truth;
}

/// Checks every node of every stored tile.
void checkAllNodes(const MadePyramid& made) {
  const Lattice lattice(made.finest);
  const double rounding = 2.0 * (made.finest + 14) * made.largest / (1 << 24);
  std::map<std::tuple<int, int, int>, NodeCodes> known;  // bintree level, x, y
  double largestError = 0.0;

  for (const auto& [id, samples] : made.samples) {
    const LevelNodes& nodes = made.pyramid.nodes[static_cast<size_t>(id.level)];
    const int index = made.pyramid.find(id);
    for (int node = 0; node < nodes.nodesPerTile; ++node) {
      const auto at = static_cast<size_t>(index * nodes.nodesPerTile + node);
      const NodePlace place = nodePlace(node, id.isRoot());
      const int shift = made.finest - id.level;
      const Diamond diamond{(id.col * kTileCells + place.x) << shift,
                            (id.row * kTileCells + place.y) << shift, place.nodeLevel + 2 * id.level};
      ASSERT_EQ(lattice.diamondAt(diamond.center()), diamond);
      const NodeCodes codes{nodes.errorCode[at], nodes.lowCode[at], nodes.highCode[at]};
      const auto [old, isNew] = known.emplace(std::tuple(diamond.level, diamond.x, diamond.y), codes);
      ASSERT_TRUE(isNew || (old->second.error == codes.error && old->second.low == codes.low &&
                            old->second.high == codes.high))
          << "copies differ: " << toString(id) << " node " << node;

      const Truth truth = measureByForce(made, id, diamond);
      largestError = std::max(largestError, truth.error);
      if (truth.low > truth.high) continue;
      ASSERT_GE(static_cast<double>(nodes.error[at]), truth.error) << toString(id) << " node " << node;
      ASSERT_LE(static_cast<double>(nodes.error[at]), truth.error + rounding)
          << toString(id) << " node " << node;
      ASSERT_GE(made.scale.errorFromCode(static_cast<uint8_t>(codes.error)), truth.error + kMaxError);
      ASSERT_LE(made.scale.heightFromRangeCode(codes.low), truth.low - kMaxError);
      ASSERT_GE(made.scale.heightFromRangeCode(codes.high), truth.high + kMaxError);
    }
  }
  EXPECT_GT(largestError, 1.0);

  // Over the whole world: strictly saturated, and nested.
  int pairs = 0;
  for (const auto& [key, codes] : known) {
    const auto& [level, x, y] = key;
    if (level == lattice.deepestLevel()) continue;
    for (const Diamond& child : lattice.children({x, y, level})) {
      const auto at = known.find(std::tuple(child.level, child.x, child.y));
      if (at == known.end()) continue;
      ASSERT_GE(codes.error, at->second.error + 1) << level << " at " << x << ", " << y;
      ASSERT_LE(codes.low, at->second.low);
      ASSERT_GE(codes.high, at->second.high);
      ++pairs;
    }
  }
  EXPECT_GT(pairs, 100);
}

TEST(NodeMeasure, HoldsForOneTile) {
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    const auto height = [seed](int64_t x, int64_t y) { return roughGround(x, y, seed); };
    checkAllNodes(MadePyramid(FunctionSource({{0, 0, 0, 256, 256, height}}, 0.1, kMaxError)));
  }
}

TEST(NodeMeasure, HoldsAcrossTilesAndHoles) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const auto height = [seed](int64_t x, int64_t y) {
      return noiseAt(x / 30, y / 30, seed) < 0.25 || noiseAt(x, y, seed + 1) < 0.02 ? kNone
                                                                                    : roughGround(x, y, seed);
    };
    const auto width = static_cast<int64_t>(300 + 60 * seed);
    checkAllNodes(MadePyramid(FunctionSource({{1, 0, 0, width, 400, height}}, 0.1, kMaxError)));
  }
}

TEST(NodeMeasure, HoldsOverThreeLevels) {
  const auto height = [](int64_t x, int64_t y) {
    return x / 64 % 3 == 0 && y / 64 % 2 == 0 ? 900.0F : roughGround(x, y, 9);
  };
  checkAllNodes(MadePyramid(FunctionSource({{2, 0, 0, 1024, 700, height}}, 0.1, kMaxError)));
}

TEST(NodeMeasure, HoldsWhereInputsOfTwoLevelsMeet) {
  for (uint64_t seed = 1; seed <= 2; ++seed) {
    const auto coarse = [seed](int64_t x, int64_t y) {
      return noiseAt(x / 20, y / 20, seed) < 0.1 ? kNone : roughGround(4 * x, 4 * y, seed);
    };
    const auto fine = [seed](int64_t x, int64_t y) { return roughGround(x, y, seed + 5); };
    checkAllNodes(MadePyramid(
        FunctionSource({{0, 0, 0, 256, 256, coarse}, {2, 180, 300, 420, 560, fine}}, 0.1, kMaxError)));
  }
}

TEST(NodeMeasure, HoldsWherePatchesAreLargerThanTiles) {
  // Level 11: the root's patches span hundreds of tiles; the data sits across a border of level 1.
  const int64_t middle = int64_t{kTileCells} << 10;
  const auto height = [](int64_t x, int64_t y) { return roughGround(x, y, 4); };
  checkAllNodes(MadePyramid(FunctionSource(
      {{11, middle - 150, middle + 1000, middle + 170, middle + 1300, height}}, 0.1, kMaxError)));
}

TEST(NodeMeasure, AVoidSampleIsAFunctionOfItsPlace) {
  const auto height = [](int64_t x, int64_t y) {
    return noiseAt(x / 50, y / 50, 3) < 0.5 ? kNone : roughGround(x, y, 3);
  };
  const MadePyramid made(FunctionSource({{2, 0, 0, 800, 900, height}}, 0.1, kMaxError));
  std::map<std::pair<int64_t, int64_t>, float> known;
  int shared = 0;
  for (const auto& [id, samples] : made.samples) {
    const int shift = made.finest - id.level;
    for (int i = 0; i < kTileSampleCount; ++i) {
      const auto place = std::pair((int64_t{id.col} * kTileCells + i % kTileSamples) << shift,
                                   (int64_t{id.row} * kTileCells + i / kTileSamples) << shift);
      const float value = samples.heights[static_cast<size_t>(i)];
      ASSERT_TRUE(std::isfinite(value));
      const auto [at, isNew] = known.emplace(place, value);
      if (isNew) continue;
      ASSERT_EQ(at->second, value);
      shared += samples.states[static_cast<size_t>(i)] == SampleState::Void ? 1 : 0;
    }
  }
  EXPECT_GT(shared, 1000);
}

}  // namespace
}  // namespace terrane
