#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <map>

#include "cut_checks.h"
#include "rounds.h"
#include "terrane/lod/octagon.h"
#include "terrane/lod/screen_metric.h"
#include "terrane/tiling/patch_template.h"

namespace terrane {
namespace {

/// How a cut shows one vertex of the lattice.
struct Shown {
  double weight = 0.0;  ///< of its own height, against the mean of its hypotenuse's ends
  Diamond by;           ///< whose split brought it in
  friend bool operator==(const Shown&, const Shown&) = default;
};
using ShownVertices = std::map<LatticePoint, Shown>;

/// Every vertex that a cut of the whole world shows. Goes down the bintree from its roots, so that it finds
/// for each vertex the split that brought it in, and fails where two triangles show one differently.
class Shower {
 public:
  explicit Shower(const Cut& cut) : cut_(cut), lattice_(cut.latticeDepth) {
    for (int which = 0; which < 2; ++which)
      templates_[which] =
          (which == 0 ? makeRightAngleTemplate(cut.grid) : makeHypotenuseTemplate(cut.grid)).vertices;
    for (const Patch& patch : cut.patches) drawn_[{patch.triangle.diamond, patch.triangle.apex}] = &patch;
    for (const Triangle& t : lattice_.rootTriangles()) visit(t);
  }
  ShownVertices vertices;

 private:
  void visit(const Triangle& t) {
    const auto drawn = drawn_.find({t.diamond, t.apex});
    if (t.diamond.level > 0) {
      const Diamond by{t.apex.x, t.apex.y, t.diamond.level - 1};
      addNew(t, {drawn == drawn_.end() ? 1.0 : static_cast<double>(drawn->second->morph), by});
    }
    if (drawn != drawn_.end()) return;
    ASSERT_LT(t.diamond.level, cut_.grid.deepestLevel(cut_.latticeDepth)) << "a hole in the cut";
    const auto ends = lattice_.hypotenuse(t.diamond);
    for (const Triangle& half : lattice_.trianglesAfterSplit(t.diamond)) {
      const auto legs = lattice_.hypotenuse(half.diamond);
      const bool mine = legs[0] == t.apex || legs[1] == t.apex;
      const bool end = legs[0] == ends[0] || legs[0] == ends[1] || legs[1] == ends[0] || legs[1] == ends[1];
      if (mine && end) visit(half);
    }
  }

  /// The vertices that a patch has and its parent lacks.
  void addNew(const Triangle& t, const Shown& shown) {
    const PatchPlacement place = placePatch(lattice_, cut_.grid, t);
    const int newLevel = t.diamond.level + 2 * cut_.grid.k - 1;
    for (const LatticePoint& v : templates_[t.diamond.isQuadCenter() ? 0 : 1]) {
      const LatticePoint turned = rotateQuarters(v, place.rotation);
      const LatticePoint at{place.origin.x + place.unit * turned.x, place.origin.y + place.unit * turned.y};
      const bool worldCorner = at.x % lattice_.side() == 0 && at.y % lattice_.side() == 0;
      if (worldCorner || lattice_.diamondAt(at).level != newLevel) continue;
      const auto [first, isNew] = vertices.try_emplace(at, shown);
      EXPECT_EQ(first->second, shown) << at.x << " " << at.y << ": two triangles disagree";
    }
  }

  const Cut& cut_;
  Lattice lattice_;
  std::array<std::vector<LatticePoint>, 2> templates_;
  std::map<std::pair<Diamond, LatticePoint>, const Patch*> drawn_;
};

double weightIn(const ShownVertices& vertices, LatticePoint at) {
  const auto found = vertices.find(at);
  return found == vertices.end() ? 0.0 : found->second.weight;
}

/// Where a diamond has split, all patches that its parents' splits made are there in full.
void expectParentsInFull(const Cut& cut) {
  const Lattice lattice(cut.latticeDepth);
  std::map<LatticePoint, float> morphs;
  for (const Patch& patch : cut.patches) {
    EXPECT_GE(patch.morph, 0.0F);
    EXPECT_LE(patch.morph, 1.0F);
    if (patch.triangle.diamond.level == 0) {
      EXPECT_EQ(patch.morph, 1.0F);
      continue;
    }
    const auto [first, isNew] = morphs.try_emplace(patch.triangle.apex, patch.morph);
    EXPECT_EQ(first->second, patch.morph);
  }
  for (const Diamond& d : splitDiamonds(cut)) {
    for (const Diamond& parent : lattice.parents(d)) {
      if (const auto at = morphs.find(parent.center()); at != morphs.end()) {
        EXPECT_EQ(at->second, 1.0F);
      }
    }
  }
}

std::set<TileId> allOf(const FakeWorld& world) {
  std::set<TileId> out;
  for (const auto& [id, tile] : world.tiles) out.insert(id);
  return out;
}

/// A point of the ground at a vertex: a height that all volumes around it hold.
glm::dvec3 groundAt(const FakeWorld& world, LatticePoint at) {
  const int shift = world.finestLevel;
  const int last = (kTileCells << shift) - 1;
  const int x = std::min(at.x, last), y = std::min(at.y, last);
  const TileId id{world.finestLevel, x / kTileCells, y / kTileCells};
  const auto node = static_cast<size_t>(
      nodeIndex(8, x % kTileCells / 16 * 16 + 8, y % kTileCells / 16 * 16 + 8, id.isRoot()));
  const TileNodes& nodes = world.tiles.at(id).nodes;
  const double height = 0.5 * (world.scale.heightFromRangeCode(nodes.low[node]) +
                               world.scale.heightFromRangeCode(nodes.high[node]));
  return {at.x * world.frame.spacingXMeters(), -at.y * world.frame.spacingYMeters(), height};
}

bool inWindow(const Camera& camera, glm::dvec3 point) {
  if (camera.viewFromLocal(point).z <= 0.1) return false;
  const glm::dvec2 pixel = camera.pixelFromLocal(point);
  return pixel.x >= 0 && pixel.y >= 0 && pixel.x <= camera.width && pixel.y <= camera.height;
}

/// A camera a small step further on.
Camera stepped(std::mt19937& random, const Camera& camera, double meters, double radians) {
  std::normal_distribution<double> any(0.0, 1.0);
  const auto direction = [&] { return glm::normalize(glm::dvec3(any(random), any(random), any(random))); };
  const glm::dvec3 eye = camera.eyeLocal + meters * direction();
  const glm::dvec3 forward = glm::normalize(camera.forward + radians * direction());
  return lookAt(eye, eye + forward, camera.fovyRadians, camera.width, camera.height);
}

/// What a vertex glides while the camera moves, on screen, is bounded by how far things move: a multiple of
/// tau for each radian of parallax. A vertex that jumped would move by its error at once.
TEST(Morph, IsContinuousInTheCamera) {
  constexpr double kMeters = 0.02, kRadians = 2e-5;
  // About s / (s - 1): the morph runs from 0 to 1 within 9 % of the distance.
  constexpr double kMultiple = 25.0;
  double worst = 0.0;
  int looked = 0, changed = 0;
  for (uint32_t seed = 0; seed < 12; ++seed) {
    std::mt19937 random(600 + seed);
    const FakeWorld world(1, seed);
    const FakeResidents residents(world, allOf(world));
    const Lattice lattice(1);
    PatchSelection selection;
    selection.grid.k = 2 + static_cast<int>(seed % 4);
    selection.cull = false;
    selection.exaggeration = seed % 3 == 0 ? 1.6 : 1.0;
    selection.tolerancePixels = seed % 2 == 0 ? 1.0 : 3.0;
    Camera camera = randomCamera(random, world);
    ShownVertices before;
    Camera last = camera;
    for (int step = 0; step < 12; ++step) {
      const Cut cut = selectPatches(selection, world.frame, world.scale, camera, residents);
      expectConforming(cut);
      expectParentsInFull(cut);
      ShownVertices now = Shower(cut).vertices;
      if (step > 0) {
        ShownVertices all = before;
        all.insert(now.begin(), now.end());
        for (const auto& [at, shown] : all) {
          const double change = std::abs(weightIn(now, at) - weightIn(before, at));
          if (change == 0.0) continue;
          glm::dvec3 point = groundAt(world, at);
          point.z *= selection.exaggeration;
          if (!inWindow(camera, point) || !inWindow(last, point)) continue;
          ++changed;
          const double distance =
              std::min(glm::length(point - camera.eyeLocal), glm::length(point - last.eyeLocal));
          const double error = world.scale.errorFromCode(errorCodeOf(world, selection.grid, shown.by)) *
                               selection.exaggeration;
          const double glides = change * error * camera.pixelsPerTangent() / distance;
          const double moves = kMeters / distance + kRadians;
          worst = std::max(worst, glides / (moves * selection.tolerancePixels));
          EXPECT_LE(glides, kMultiple * selection.tolerancePixels * moves)
              << "seed " << seed << " step " << step << " at " << at.x << " " << at.y << " from "
              << weightIn(before, at) << " to " << weightIn(now, at);
        }
        looked += static_cast<int>(all.size());
      }
      before = std::move(now);
      last = camera;
      camera = stepped(random, camera, kMeters, kRadians);
    }
  }
  std::printf("of %d vertices looked at %d glided, at most %.1f times tau a radian of parallax\n", looked,
              changed, worst);
  EXPECT_GT(changed, 10000);
}

/// The same steps without morphing: the test above can tell.
TEST(Morph, WithoutItVerticesJump) {
  std::mt19937 random(601);
  const FakeWorld world(1, 1);
  const FakeResidents residents(world, allOf(world));
  PatchSelection selection;
  selection.grid.k = 2;
  selection.cull = false;
  selection.morph = false;
  Camera camera = randomCamera(random, world);
  ShownVertices before;
  int jumps = 0;
  for (int step = 0; step < 200; ++step) {
    const Cut cut = selectPatches(selection, world.frame, world.scale, camera, residents);
    for (const Patch& patch : cut.patches) EXPECT_EQ(patch.morph, 1.0F);
    ShownVertices now = Shower(cut).vertices;
    if (step > 0)
      for (const auto& [at, shown] : now) jumps += before.count(at) == 0;
    before = std::move(now);
    camera = stepped(random, camera, 0.5, 1e-4);
  }
  EXPECT_GT(jumps, 100);
}

/// A diamond glides as slowly as it may: of its own error and its children's, mixed, tau is left on screen
/// all the way, until it is there in full; by then its children ask for nothing yet.
TEST(Morph, LeavesExactlyTauOnTheWay) {
  const double saturation = std::exp2(0.125);
  int gliding = 0, slow = 0;
  for (uint32_t seed = 0; seed < 8; ++seed) {
    std::mt19937 random(650 + seed);
    const FakeWorld world(2, seed);
    const FakeResidents residents(world, allOf(world));
    const Lattice lattice(2);
    PatchSelection selection;
    selection.grid.k = 4 + static_cast<int>(seed % 2);
    selection.cull = false;
    selection.texelPixels = 1e6;
    selection.tolerancePixels = seed % 3 == 0 ? 2.5 : 1.0;
    const NestedOctagons octagons(lattice, selection.grid.deepestLevel(2));
    for (int view = 0; view < 12; ++view) {
      const Camera camera = randomCamera(random, world);
      const ScreenMetric metric(camera, {world.frame.spacingXMeters(), world.frame.spacingYMeters()},
                                selection.tolerancePixels, selection.nearMeters);
      for (const Patch& patch :
           selectPatches(selection, world.frame, world.scale, camera, residents).patches) {
        if (patch.triangle.diamond.level == 0) continue;
        const Diamond by{patch.triangle.apex.x, patch.triangle.apex.y, patch.triangle.diamond.level - 1};
        const double error = world.scale.errorFromCode(errorCodeOf(world, selection.grid, by));
        const FakeWorld::Code& code = world.codes.at(by);
        const Prism prism{{by.x, by.y},
                          octagons.nested(by.level),
                          world.scale.heightFromRangeCode(code.low) - error,
                          world.scale.heightFromRangeCode(code.high) + error};
        const double excess = metric.errorPixels(prism, error) / selection.tolerancePixels;
        double children = 0.0;
        for (const Diamond& c : lattice.children(by))
          children = std::max(children, world.scale.errorFromCode(errorCodeOf(world, selection.grid, c)));
        const auto morph = static_cast<double>(patch.morph);
        if (morph == 1.0) {
          EXPECT_GE(excess, std::min(std::sqrt(2.0), error / children) * (1.0 - 1e-6));
          continue;
        }
        const double left = excess * (1.0 - morph + morph * children / error);
        EXPECT_LE(left, 1.0 + 1e-5) << "seed " << seed << " view " << view << " morph " << morph;
        if (children * std::sqrt(2.0) >= error) {
          EXPECT_GE(left, 1.0 - 1e-5);
        }
        ++gliding;
        slow += excess > saturation;
      }
    }
  }
  std::printf("%d patches glided, %d of them above the strict saturation\n", gliding, slow);
  EXPECT_GT(gliding, 1000);
  EXPECT_GT(slow, 300);
}

/// With everything resident a history changes nothing, wherever the camera goes.
TEST(Morph, NothingFadesInWhereAllWasHere) {
  for (uint32_t seed = 0; seed < 4; ++seed) {
    std::mt19937 random(700 + seed);
    const FakeWorld world(2, seed);
    const FakeResidents residents(world, allOf(world));
    MorphHistory history;
    Camera camera = randomCamera(random, world);
    for (int step = 0; step < 20; ++step) {
      const Cut with = selectPatches({}, world.frame, world.scale, camera, residents, &history, 0.016);
      const Cut without = selectPatches({}, world.frame, world.scale, camera, residents);
      EXPECT_EQ(with.ramping, 0);
      ASSERT_EQ(with.patches.size(), without.patches.size());
      for (size_t i = 0; i < with.patches.size(); ++i) {
        ASSERT_EQ(with.patches[i].triangle, without.patches[i].triangle);
        ASSERT_EQ(with.patches[i].morph, without.patches[i].morph);
      }
      camera = step % 7 == 6 ? randomCamera(random, world) : stepped(random, camera, 5.0, 0.01);
    }
  }
}

/// Tiles that arrive, in any order: nothing ever jumps in time, children wait for their parents, and in the
/// end the cut is the one that needs no history.
TEST(Morph, WhatArrivesFadesIn) {
  constexpr double kStep = 0.004;
  constexpr double kMostAStep = 16.0 * kStep / 0.3;
  int64_t faded = 0;
  for (uint32_t seed = 0; seed < rounds(8U); ++seed) {
    std::mt19937 random(800 + seed);
    const FakeWorld world(1, seed);
    PatchSelection selection;
    selection.grid.k = 2 + static_cast<int>(seed % 3);
    selection.cull = false;
    const Camera camera = randomCamera(random, world);
    FakeResidents residents(world, {TileId{}});
    MorphHistory history;
    Cut cut = selectPatches(selection, world.frame, world.scale, camera, residents, &history, 0.0);
    EXPECT_EQ(cut.ramping, 0) << "the first picture is there at once";
    ShownVertices before = Shower(cut).vertices;
    for (int step = 0; !cut.wishes.empty() || cut.ramping > 0; ++step) {
      ASSERT_LT(step, 5000);
      // Now none, now many, while others are on their way.
      const auto arriving = random() % 6 == 0 ? random() % 9 : 0;
      for (size_t i = 0; i < std::min<size_t>(arriving, cut.wishes.size()); ++i)
        residents.ids().insert(cut.wishes[random() % cut.wishes.size()].tile);
      cut = selectPatches(selection, world.frame, world.scale, camera, residents, &history, kStep);
      expectConforming(cut);
      expectParentsInFull(cut);
      ShownVertices now = Shower(cut).vertices;
      for (const auto& [at, shown] : now) {
        const double change = shown.weight - weightIn(before, at);
        EXPECT_LE(change, kMostAStep + 1e-6) << "seed " << seed << " step " << step;
        EXPECT_GE(change, 0.0);
        faded += change > 0.0;
      }
      for (const auto& [at, shown] : before) EXPECT_NE(now.count(at), 0U);
      before = std::move(now);
    }
    const Cut goal = selectPatches(selection, world.frame, world.scale, camera, residents);
    ASSERT_EQ(cut.patches.size(), goal.patches.size());
    for (size_t i = 0; i < cut.patches.size(); ++i) {
      EXPECT_EQ(cut.patches[i].triangle, goal.patches[i].triangle);
      EXPECT_EQ(cut.patches[i].morph, goal.patches[i].morph);
      EXPECT_EQ(cut.patches[i].shadingTile, goal.patches[i].shadingTile);
    }
  }
  EXPECT_GT(faded, rounds(10000));
}

/// Cameras that fly while tiles come and go, with steps of all lengths: cuts conform, children wait; and the
/// same sequence gives the same cuts.
TEST(Morph, MixedRampsConformWhateverHappens) {
  for (uint32_t seed = 0; seed < rounds(10U); ++seed) {
    std::array<std::vector<Cut>, 2> runs;
    for (std::vector<Cut>& cuts : runs) {
      std::mt19937 random(900 + seed);
      const FakeWorld world(2, seed);
      PatchSelection selection;
      selection.grid.k = 2 + static_cast<int>(seed % 5);
      selection.cull = false;
      Camera camera = randomCamera(random, world);
      FakeResidents residents(world, randomResidents(random, 2, 0.3));
      MorphHistory history;
      for (int step = 0; step < 40; ++step) {
        const double seconds = std::exp2(-static_cast<double>(random() % 10));
        cuts.push_back(
            selectPatches(selection, world.frame, world.scale, camera, residents, &history, seconds));
        if (random() % 10 == 0) {
          residents.ids() = randomResidents(random, 2, 0.7);
        } else if (!cuts.back().wishes.empty()) {
          residents.ids().insert(cuts.back().wishes[random() % cuts.back().wishes.size()].tile);
        }
        camera = stepped(random, camera, 30.0, 0.05);
      }
    }
    int ramping = 0;
    ASSERT_EQ(runs[0].size(), runs[1].size());
    for (size_t i = 0; i < runs[0].size(); ++i) {
      const Cut& cut = runs[0][i];
      expectConforming(cut);
      expectParentsInFull(cut);
      Shower(cut).vertices.clear();  // both sides of every edge agree
      ramping += cut.ramping;
      ASSERT_EQ(cut.patches.size(), runs[1][i].patches.size());
      for (size_t patch = 0; patch < cut.patches.size(); ++patch) {
        EXPECT_EQ(cut.patches[patch].triangle, runs[1][i].patches[patch].triangle);
        EXPECT_EQ(cut.patches[patch].morph, runs[1][i].patches[patch].morph);
      }
    }
    EXPECT_GT(ramping, 0);
  }
}

/// A whole chain of levels that arrives at once takes little longer than one, at any frame rate.
TEST(Morph, AChainOfLevelsArrivesInAboutHalfASecond) {
  for (const double framesPerSecond : {20.0, 60.0, 240.0}) {
    double longest = 0.0;
    for (uint32_t seed = 0; seed < 6; ++seed) {
      std::mt19937 random(950 + seed);
      const FakeWorld world(3, seed);
      const Camera camera = randomCamera(random, world);
      FakeResidents residents(world, {TileId{}});
      MorphHistory history;
      selectPatches({}, world.frame, world.scale, camera, residents, &history, 0.0);
      residents.ids() = allOf(world);
      // The frame in which they come shows them as they were.
      Cut cut =
          selectPatches({}, world.frame, world.scale, camera, residents, &history, 1.0 / framesPerSecond);
      EXPECT_GT(cut.ramping, 0);
      double seconds = 0.0;
      while (cut.ramping > 0 && seconds < 5.0) {
        seconds += 1.0 / framesPerSecond;
        cut = selectPatches({}, world.frame, world.scale, camera, residents, &history, 1.0 / framesPerSecond);
      }
      longest = std::max(longest, seconds);
    }
    std::printf("%.0f frames a second: the last of all levels was there after %.3f s\n", framesPerSecond,
                longest);
    EXPECT_GE(longest, 0.05);
    EXPECT_LE(longest, 0.65);
  }
}

TEST(Morph, WhatAHistoryIsOfAnotherLatticeIsForgotten) {
  const FakeWorld world(1, 3);
  std::mt19937 random(3);
  const Camera camera = randomCamera(random, world);
  FakeResidents residents(world, {TileId{}});
  MorphHistory history;
  PatchSelection selection;
  selectPatches(selection, world.frame, world.scale, camera, residents, &history, 0.0);
  EXPECT_FALSE(history.heldBack.empty());
  residents.ids() = allOf(world);
  selection.grid.k = 5;
  const Cut cut = selectPatches(selection, world.frame, world.scale, camera, residents, &history, 0.01);
  EXPECT_EQ(cut.ramping, 0);
}

}  // namespace
}  // namespace terrane
