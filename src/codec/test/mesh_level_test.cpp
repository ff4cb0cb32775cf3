#include "terrane/codec/mesh_level.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <set>

#include "made_ground.h"
#include "terrane/tiling/lattice.h"

namespace terrane {
namespace {

using Point = std::array<int, 2>;

struct MeshedTile {
  TileId id;
  Tile tile;
  std::map<int, MeshLevel> levels;
};

/// Levels of the root, and of its children, each from the one before.
class MeshedWorld {
 public:
  MeshedWorld(unsigned seed, double spacingMeters) : random_(seed), ground_(1, someGround(seed, random_)) {
    scale_.errorUnit = 0.05;
    meshScale_.spacingMeters = spacingMeters;
    meshScale_.finestLevel = 1;
    if (seed < kFirstInLayers) return;
    const std::vector<double> offsets = ground_.divide({0.5 * spacingMeters, 0.1 * spacingMeters});
    meshScale_.layerCount = static_cast<int>(offsets.size()) + 1;
    std::copy(offsets.begin(), offsets.end(), meshScale_.layerOffsets.begin());
    EXPECT_EQ(meshScale_.layerOf(meshScale_.deepestLevel()), meshScale_.layerCount - 1) << "seed " << seed;
    EXPECT_LT(meshScale_.layerOf(2), meshScale_.layerCount - 1) << "seed " << seed;
  }
  static constexpr unsigned kFirstInLayers = 10;

  MeshedTile root(int lastLevel) { return make({}, nullptr, lastLevel); }
  MeshedTile child(const MeshedTile& root, int quadrant, int lastLevel) {
    return make(TileId{}.child(quadrant), &root.levels.at(meshScale_.lastOwnLevel()), lastLevel);
  }
  const MeshScale& meshScale() const { return meshScale_; }
  const ElevationScale& scale() const { return scale_; }

 private:
  MeshedTile make(TileId id, const MeshLevel* before, int lastLevel) {
    MeshedTile out{id, ground_.tile(id, random_, 30), {}};
    for (int level = meshScale_.firstLevel(id.isRoot()); level <= lastLevel; ++level) {
      out.levels.emplace(level, makeMeshLevel(id, out.tile, level, before, meshScale_, scale_));
      before = &out.levels.at(level);
    }
    return out;
  }

  std::mt19937 random_;
  MadeGround ground_;
  ElevationScale scale_;
  MeshScale meshScale_;
};

int64_t doubleArea(Point a, Point b, Point c) {
  return int64_t{b[0] - a[0]} * (c[1] - a[1]) - int64_t{b[1] - a[1]} * (c[0] - a[0]);
}
bool isBetween(Point a, Point b, Point p) {
  return doubleArea(a, b, p) == 0 && std::min(a[0], b[0]) <= p[0] && p[0] <= std::max(a[0], b[0]) &&
         std::min(a[1], b[1]) <= p[1] && p[1] <= std::max(a[1], b[1]);
}

/// One patch's mesh, taken out of its level.
struct OnePatch {
  PatchCorners corners;
  std::vector<PatchVertex> vertices;
  std::vector<std::array<int, 3>> triangles;
  double errorMeters = 0.0;
  double startErrorMeters = 0.0;
  Point place(int i) const {
    return {vertices[static_cast<size_t>(i)].x(), vertices[static_cast<size_t>(i)].y()};
  }
  std::array<std::array<Point, 2>, 3> sides() const {
    return {{{corners.ends[0], corners.ends[1]},
             {corners.ends[0], corners.apex},
             {corners.ends[1], corners.apex}}};
  }
};
OnePatch patchOf(const MeshedTile& tile, int level, int index) {
  const MeshLevel& meshes = tile.levels.at(level);
  const MeshLevel::Patch& patch = meshes.patches[static_cast<size_t>(index)];
  OnePatch out;
  out.corners = patchCorners(level, index, (tile.id.col + tile.id.row) % 2 == 0);
  out.vertices.assign(meshes.vertices.begin() + patch.firstVertex,
                      meshes.vertices.begin() + patch.firstVertex + patch.vertexCount);
  for (uint32_t i = 0; i < patch.indexCount; i += 3) {
    const uint16_t* t = &meshes.indices[patch.firstIndex + i];
    out.triangles.push_back({t[0], t[1], t[2]});
  }
  out.errorMeters = static_cast<double>(patch.errorMeters);
  out.startErrorMeters = static_cast<double>(patch.startErrorMeters);
  return out;
}

class MeshLevels : public ::testing::TestWithParam<unsigned> {};

TEST(PatchCorners, AreFoundAgainAndCoverTheTileOnce) {
  for (int level = 0; level <= 8; ++level) {
    int64_t area = 0;
    for (int index = 0; index < patchCount(level); ++index) {
      const PatchCorners c = patchCorners(level, index, true);
      const Point middle{(c.ends[0][0] + c.ends[1][0]) / 2, (c.ends[0][1] + c.ends[1][1]) / 2};
      EXPECT_EQ(patchIndex(level, middle, c.apex), index) << "level " << level;
      area += std::abs(doubleArea(c.ends[0], c.ends[1], c.apex));
      // They are the lattice's triangles.
      const Lattice lattice(0);
      const Diamond d = lattice.diamondAt({middle[0], middle[1]});
      EXPECT_EQ(d.level, level);
      const auto ends = lattice.hypotenuse(d);
      const std::set<Point> expected = {{ends[0].x, ends[0].y}, {ends[1].x, ends[1].y}};
      EXPECT_EQ((std::set<Point>{c.ends[0], c.ends[1]}), expected);
    }
    EXPECT_EQ(area, 2 * 256 * 256);
  }
}

/// Every triangle turns the right way, every inner side belongs to two of them, and the outer ones to the
/// patch's sides: together they are the patch.
TEST_P(MeshLevels, AreWholeAndConform) {
  MeshedWorld world(GetParam(), 2.0);
  const MeshedTile root = world.root(8);
  const MeshedTile child = world.child(root, 3, 8);
  for (const MeshedTile* tile : {&root, &child}) {
    for (const auto& [level, meshes] : tile->levels) {
      for (int index = 0; index < patchCount(level); ++index) {
        const OnePatch patch = patchOf(*tile, level, index);
        std::map<std::pair<Point, Point>, int> sides;
        int64_t area = 0;
        for (const auto& t : patch.triangles) {
          const int64_t twice = doubleArea(patch.place(t[0]), patch.place(t[1]), patch.place(t[2]));
          ASSERT_GT(twice, 0);
          area += twice;
          for (size_t i = 0; i < 3; ++i) ++sides[{patch.place(t[i]), patch.place(t[(i + 1) % 3])}];
        }
        ASSERT_EQ(area,
                  std::abs(doubleArea(patch.corners.ends[0], patch.corners.ends[1], patch.corners.apex)));
        for (const auto& counted : sides) {
          const auto& [from, to] = counted.first;
          ASSERT_EQ(counted.second, 1);
          if (sides.count({to, from}) != 0) continue;
          const auto outer = patch.sides();
          const auto isOn = [&](const std::array<Point, 2>& side) {
            return isBetween(side[0], side[1], counted.first.first) &&
                   isBetween(side[0], side[1], counted.first.second);
          };
          ASSERT_TRUE(std::any_of(outer.begin(), outer.end(), isOn))
              << "level " << level << ", patch " << index << ": an open side inside";
        }
      }
    }
  }
}

/// What stands on a side: place, own height, coarse height.
using SideVertices = std::vector<std::tuple<Point, float>>;
/// Sides in samples of the finest tiles, by their ends in order.
using SideKey = std::pair<Point, Point>;

Point inFinest(TileId id, Point p) {
  const int step = id.level == 0 ? 2 : 1;
  return {(id.col * kTileCells + p[0]) * step, (id.row * kTileCells + p[1]) * step};
}

void takeSides(const MeshedTile& tile, int level, std::map<SideKey, std::vector<SideVertices>>& out,
               std::map<SideKey, std::vector<std::vector<float>>>* coarse) {
  for (int index = 0; index < patchCount(level); ++index) {
    const OnePatch patch = patchOf(tile, level, index);
    for (const auto& side : patch.sides()) {
      SideKey key{inFinest(tile.id, side[0]), inFinest(tile.id, side[1])};
      if (key.second < key.first) std::swap(key.first, key.second);
      std::vector<std::tuple<Point, float, float>> found;
      for (const PatchVertex& v : patch.vertices)
        if (isBetween(side[0], side[1], {v.x(), v.y()}))
          found.emplace_back(inFinest(tile.id, {v.x(), v.y()}), v.heightMeters, v.coarseMeters);
      std::sort(found.begin(), found.end());
      SideVertices vertices;
      std::vector<float> heights;
      for (const auto& [place, own, before] : found) {
        vertices.emplace_back(place, own);
        heights.push_back(before);
      }
      out[key].push_back(vertices);
      if (coarse != nullptr) (*coarse)[key].push_back(heights);
    }
  }
}

/// Patches of a level and of the next that share a side have the same vertices on it, bit for bit; and those
/// of one level the same coarse heights. Tiles side by side, a tile below its parent, levels beyond a tile's
/// own.
TEST_P(MeshLevels, MeetAtTheirSides) {
  MeshedWorld world(GetParam(), 2.0);
  const MeshedTile root = world.root(8);
  std::vector<MeshedTile> children;
  for (int quadrant = 0; quadrant < 4; ++quadrant) children.push_back(world.child(root, quadrant, 8));
  const int own = world.meshScale().lastOwnLevel();

  // By bintree level: the root's own levels, then the children's.
  std::map<int, std::vector<std::pair<const MeshedTile*, int>>> levels;
  for (int level = 0; level <= own; ++level) levels[level].emplace_back(&root, level);
  for (int level = own - 1; level <= 8; ++level)
    for (const MeshedTile& child : children) levels[level + 2].emplace_back(&child, level);
  // The root goes on where children are missing: beside its own levels.
  int64_t shared = 0;
  for (auto at = levels.begin(); at != levels.end(); ++at) {
    std::map<SideKey, std::vector<SideVertices>> sides;
    std::map<SideKey, std::vector<std::vector<float>>> coarse;
    for (const auto& [tile, level] : at->second) takeSides(*tile, level, sides, &coarse);
    for (const auto& [key, heights] : coarse)
      for (const auto& other : heights) ASSERT_EQ(other, heights.front()) << "coarse, level " << at->first;
    if (const auto next = std::next(at); next != levels.end())
      for (const auto& [tile, level] : next->second) takeSides(*tile, level, sides, nullptr);
    for (const auto& [key, vertices] : sides) {
      for (const SideVertices& other : vertices) ASSERT_EQ(other, vertices.front()) << "level " << at->first;
      shared += static_cast<int64_t>(vertices.size()) - 1;
    }
  }
  EXPECT_GT(shared, 1000);

  // And the root's deeper levels among themselves.
  for (int level = own; level < 8; ++level) {
    std::map<SideKey, std::vector<SideVertices>> sides;
    takeSides(root, level, sides, nullptr);
    takeSides(root, level + 1, sides, nullptr);
    for (const auto& [key, vertices] : sides)
      for (const SideVertices& other : vertices) ASSERT_EQ(other, vertices.front()) << "level " << level;
  }
}

/// The stated error, by brute force: at each measured sample what the block gets wrong and how far the mesh
/// is from it.
TEST_P(MeshLevels, KeepToTheirError) {
  MeshedWorld world(GetParam(), 2.0);
  const MeshedTile root = world.root(8);
  const MeshedTile child = world.child(root, 1, 8);
  for (const MeshedTile* tile : {&root, &child}) {
    const std::vector<uint8_t> measured = measuredSamples(tile->tile.samples, tile->id.level == 1);
    for (const auto& [level, meshes] : tile->levels) {
      const double bound = world.meshScale().boundMeters(level + 2 * tile->id.level);
      for (int index = 0; index < patchCount(level); ++index) {
        const OnePatch patch = patchOf(*tile, level, index);
        EXPECT_GE(patch.errorMeters, bound * (1.0 - 1e-6));
        for (const auto& t : patch.triangles) {
          const Point a = patch.place(t[0]), b = patch.place(t[1]), c = patch.place(t[2]);
          const auto area = static_cast<double>(doubleArea(a, b, c));
          const auto drawnBy = [&](float PatchVertex::*height, double wa, double wb, double wc) {
            const auto at = [&](int i) {
              return static_cast<double>(patch.vertices[static_cast<size_t>(i)].*height);
            };
            return (wa * at(t[0]) + wb * at(t[1]) + wc * at(t[2])) / area;
          };
          for (int y = std::min({a[1], b[1], c[1]}); y <= std::max({a[1], b[1], c[1]}); ++y) {
            for (int x = std::min({a[0], b[0], c[0]}); x <= std::max({a[0], b[0], c[0]}); ++x) {
              const Point p{x, y};
              const int64_t wa = doubleArea(p, b, c), wb = doubleArea(a, p, c), wc = doubleArea(a, b, p);
              const auto at = static_cast<size_t>(y * kTileSamples + x);
              if (wa < 0 || wb < 0 || wc < 0 || (!measured.empty() && measured[at] == 0)) continue;
              const auto offBy = [&](float PatchVertex::*height) {
                return std::abs(drawnBy(height, static_cast<double>(wa), static_cast<double>(wb),
                                        static_cast<double>(wc)) -
                                static_cast<double>(tile->tile.samples.heights[at]));
              };
              // The blocks that the sample and the patch share.
              const int middleX =
                  (patch.corners.ends[0][0] + patch.corners.ends[1][0] + 2 * patch.corners.apex[0]) / 4;
              const int middleY =
                  (patch.corners.ends[0][1] + patch.corners.ends[1][1] + 2 * patch.corners.apex[1]) / 4;
              const int col = std::min((x - (x > middleX ? 1 : 0)) / 16, 15),
                        row = std::min((y - (y > middleY ? 1 : 0)) / 16, 15);
              const double block = world.scale().errorFromCode(tile->tile.nodes.error[static_cast<size_t>(
                  nodeIndex(8, col * 16 + 8, row * 16 + 8, tile->id.isRoot()))]);
              ASSERT_LE(offBy(&PatchVertex::heightMeters) + block, patch.errorMeters * (1.0 + 1e-5) + 1e-4)
                  << "level " << level << ", patch " << index << ", sample " << x << " " << y;
              ASSERT_LE(offBy(&PatchVertex::coarseMeters) + block,
                        patch.startErrorMeters * (1.0 + 1e-5) + 1e-4)
                  << "level " << level << ", patch " << index << ", sample " << x << " " << y;
            }
          }
        }
      }
    }
  }
}

/// The surface of all samples at a place in cells; NaN beside samples that do not count.
double finestHeight(const TileSamples& samples, const std::vector<uint8_t>& measured, double x, double y) {
  const int col = std::min(static_cast<int>(x), kTileCells - 1),
            row = std::min(static_cast<int>(y), kTileCells - 1);
  const auto h = [&](int dx, int dy) {
    const auto at = static_cast<size_t>((row + dy) * kTileSamples + col + dx);
    return !measured.empty() && measured[at] == 0 ? std::nan("") : static_cast<double>(samples.heights[at]);
  };
  const double u = x - col, v = y - row;
  if ((col + row) % 2 == 0)
    return u > v ? h(0, 0) + u * (h(1, 0) - h(0, 0)) + v * (h(1, 1) - h(1, 0))
                 : h(0, 0) + v * (h(0, 1) - h(0, 0)) + u * (h(1, 1) - h(0, 1));
  return u + v < 1.0 ? h(0, 0) + u * (h(1, 0) - h(0, 0)) + v * (h(0, 1) - h(0, 0))
                     : h(1, 1) + (1.0 - u) * (h(0, 1) - h(1, 1)) + (1.0 - v) * (h(1, 0) - h(1, 1));
}

/// Between samples, too, where triangles that replaced extra vertices cross the finest ones.
TEST_P(MeshLevels, KeepToTheirErrorBetweenSamples) {
  MeshedWorld world(GetParam(), 2.0);
  const MeshedTile root = world.root(8);
  const MeshedTile child = world.child(root, 2, 8);
  std::mt19937 random(GetParam());
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const MeshedTile* tile : {&root, &child}) {
    const std::vector<uint8_t> measured = measuredSamples(tile->tile.samples, tile->id.level == 1);
    for (const auto& [level, meshes] : tile->levels) {
      for (int index = 0; index < patchCount(level); ++index) {
        const OnePatch patch = patchOf(*tile, level, index);
        for (const auto& t : patch.triangles) {
          for (int i = 0; i < 6; ++i) {
            // Half of them on a side of the triangle.
            const double a = unit(random), b = i % 2 == 0 ? 0.0 : unit(random) * (1.0 - a);
            const double weights[3] = {a, b, 1.0 - a - b};
            double x = 0.0, y = 0.0, drawn = 0.0, drawnAtStart = 0.0;
            for (size_t j = 0; j < 3; ++j) {
              const PatchVertex& v = patch.vertices[static_cast<size_t>(t[(j + static_cast<size_t>(i)) % 3])];
              x += weights[j] * v.x();
              y += weights[j] * v.y();
              drawn += weights[j] * static_cast<double>(v.heightMeters);
              drawnAtStart += weights[j] * static_cast<double>(v.coarseMeters);
            }
            const double finest = finestHeight(tile->tile.samples, measured, x, y);
            const double off = std::abs(drawn - finest);
            if (std::isnan(off)) continue;
            const int node = nodeIndex(8, std::min(static_cast<int>(x) / 16, 15) * 16 + 8,
                                       std::min(static_cast<int>(y) / 16, 15) * 16 + 8, tile->id.isRoot());
            const double block =
                world.scale().errorFromCode(tile->tile.nodes.error[static_cast<size_t>(node)]);
            // note: on the border of blocks the other one may be meant.
            const auto isMultiple = [](double at) { return std::abs(std::remainder(at, 16.0)) < 1e-9; };
            const bool isBorder = isMultiple(x) || isMultiple(y);
            ASSERT_LE(off + (isBorder ? 0.0 : block), patch.errorMeters * (1.0 + 1e-5) + 1e-4)
                << "level " << level << ", patch " << index << ", at " << x << " " << y;
            ASSERT_LE(std::abs(drawnAtStart - finest) + (isBorder ? 0.0 : block),
                      patch.startErrorMeters * (1.0 + 1e-5) + 1e-4)
                << "level " << level << ", patch " << index << ", at " << x << " " << y;
          }
        }
      }
    }
  }
}

/// Places of all triangles, at any morph: below the top of their square, and on the sides of squares not
/// below what is said of them.
TEST_P(MeshLevels, KeepToTheirRelief) {
  MeshedWorld world(GetParam(), 2.0);
  const MeshedTile root = world.root(10);
  const MeshedTile child = world.child(root, 1, 8);
  std::mt19937 random(GetParam());
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int64_t tops = 0, floors = 0;
  for (const MeshedTile* tile : {&root, &child}) {
    for (const auto& [level, meshes] : tile->levels) {
      const MeshRelief& relief = meshes.relief;
      const int step = reliefStep(level);
      ASSERT_EQ(relief.step, step);
      const auto isInside = [](std::array<int, 2> reach, int square, int side) {
        return reach[0] <= square && square + side <= reach[1];
      };
      size_t code = 0;
      for (int index = 0; index < patchCount(level); ++index) {
        const OnePatch patch = patchOf(*tile, level, index);
        const PatchOutline outline(patch.corners);
        std::map<Point, double> top, onRow, onColumn;
        const auto next = [&] {
          return static_cast<double>(
              relief.ranges[static_cast<size_t>(index)].height(relief.codes.at(code++)));
        };
        const size_t begin = code;
        for (int y = outline.top; y < outline.bottom; y += step)
          for (int x = outline.inRows(y, step)[0]; x < outline.inRows(y, step)[1]; x += step)
            top[{x, y}] = next();
        for (int y = outline.top; y <= outline.bottom; y += step)
          for (int x = outline.left; x < outline.right; x += step)
            if (isInside(outline.onRow(y), x, step)) onRow[{x, y}] = next();
        for (int x = outline.left; x <= outline.right; x += step)
          for (int y = outline.top; y < outline.bottom; y += step)
            if (isInside(outline.onColumn(x), y, step)) onColumn[{x, y}] = next();
        ASSERT_EQ(static_cast<int>(code - begin), reliefCounts(level, outline).all());

        for (const auto& t : patch.triangles) {
          const double morph = random() % 3 == 0 ? 1.0 : random() % 2 == 0 ? 0.0 : unit(random);
          const auto height = [&](int i) {
            const PatchVertex& v = patch.vertices[static_cast<size_t>(i)];
            const auto own = static_cast<double>(v.heightMeters),
                       coarse = static_cast<double>(v.coarseMeters);
            return coarse + morph * (own - coarse);
          };
          // A place inside, and one where a side crosses a side of squares.
          const double a = unit(random), b = (1.0 - a) * unit(random);
          const double inside[3] = {a, b, 1.0 - a - b};
          double x = 0.0, y = 0.0, z = 0.0;
          for (size_t i = 0; i < 3; ++i) {
            x += inside[i] * patch.place(t[i])[0];
            y += inside[i] * patch.place(t[i])[1];
            z += inside[i] * height(t[i]);
          }
          const Point square{static_cast<int>(x) / step * step, static_cast<int>(y) / step * step};
          ASSERT_LE(z, top.at(square) + 1e-3) << "level " << level << ", patch " << index;
          ++tops;
          for (size_t i = 0; i < 3; ++i) {
            const Point p = patch.place(t[i]), q = patch.place(t[(i + 1) % 3]);
            for (const size_t axis : {size_t{0}, size_t{1}}) {
              const int low = std::min(p[axis], q[axis]), high = std::max(p[axis], q[axis]);
              if (low == high) continue;
              const int line = (low + step - 1) / step * step;
              if (line > high) continue;
              const double share = static_cast<double>(line - p[axis]) / (q[axis] - p[axis]);
              const double along = p[1 - axis] + share * (q[1 - axis] - p[1 - axis]);
              const double drawn = height(t[i]) + share * (height(t[(i + 1) % 3]) - height(t[i]));
              const int at = static_cast<int>(along) / step * step;
              const auto& known = axis == 0 ? onColumn : onRow;
              const auto found = known.find(axis == 0 ? Point{line, at} : Point{at, line});
              if (found == known.end()) continue;  // the end of a line, on the patch's side
              ASSERT_GE(drawn, found->second - 1e-3) << "level " << level << ", patch " << index;
              ++floors;
            }
          }
        }
      }
      ASSERT_EQ(code, relief.codes.size());
    }
  }
  EXPECT_GT(tops, 10000);
  EXPECT_GT(floors, 10000);
}

/// The deepest level of the finest tiles shows every sample.
TEST_P(MeshLevels, EndWithAllSamples) {
  MeshedWorld world(GetParam(), 2.0);
  const MeshedTile root = world.root(2);
  const MeshedTile child = world.child(root, 2, 8);
  for (const MeshLevel::Patch& patch : child.levels.at(8).patches) {
    double largest = 0.0;
    for (const uint8_t code : child.tile.nodes.error)
      largest = std::max(largest, world.scale().errorFromCode(code));
    EXPECT_LE(static_cast<double>(patch.errorMeters), largest + 2.0 / 1024);
  }
}

INSTANTIATE_TEST_SUITE_P(Grounds, MeshLevels, ::testing::Range(0U, 10U));
INSTANTIATE_TEST_SUITE_P(InLayers, MeshLevels, ::testing::Values(10U, 11U, 14U));

}  // namespace
}  // namespace terrane
