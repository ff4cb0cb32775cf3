#include "studied_ground.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

namespace terrane {
namespace {

Frame frameOf(int finestLevel) {
  Frame out;
  out.finestLevel = finestLevel;
  return out;
}

using Lines = std::vector<std::vector<glm::dvec2>>;

Lines randomLines(std::mt19937& random, double side) {
  std::uniform_real_distribution<double> place(-0.1 * side, 1.1 * side);
  Lines out(1 + random() % 3);
  for (auto& line : out)
    for (size_t i = 0, count = 1 + random() % 5; i < count; ++i)
      line.emplace_back(place(random), place(random));
  return out;
}

/// By walking along the lines in small steps: every tile of a level that they come into.
std::set<TileId> walked(const Lines& lines, const Frame& frame, int level) {
  std::set<TileId> out;
  const double side = std::ldexp(kTileCells, frame.finestLevel - level);
  const auto visit = [&](glm::dvec2 at) {
    const TileId id{level, static_cast<int32_t>(std::floor(at.x / side)),
                    static_cast<int32_t>(std::floor(at.y / side))};
    if (id.col >= 0 && id.row >= 0 && id.col < 1 << level && id.row < 1 << level) out.insert(id);
  };
  for (const auto& line : lines) {
    visit(line[0]);
    for (size_t i = 1; i < line.size(); ++i)
      for (int step = 0; step <= 4000; ++step) visit(line[i - 1] + (line[i] - line[i - 1]) * (step / 4000.0));
  }
  return out;
}

TEST(StudiedGround, AreTheTilesThatTheLinesComeInto) {
  const Frame frame = frameOf(4);
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const Lines lines = randomLines(random, static_cast<double>(frame.worldCells()));
    const std::vector<TileId> found = tilesAlong(
        lines, frame, [](TileId) { return true; }, 100000);
    const std::set<TileId> unique(found.begin(), found.end());
    ASSERT_EQ(unique.size(), found.size());
    const std::set<TileId> expected = walked(lines, frame, 4);
    if (expected.empty()) continue;
    for (const TileId id : expected) ASSERT_EQ(unique.count(id), 1U) << toString(id);
    // Steps miss what is hardly touched.
    ASSERT_LE(unique.size(), expected.size() + expected.size() / 4 + 8);
  }
}

TEST(StudiedGround, AreAsFineAsFitsAndIsStored) {
  const Frame frame = frameOf(6);
  std::mt19937 random(2);
  for (int i = 0; i < 200; ++i) {
    const Lines lines = randomLines(random, static_cast<double>(frame.worldCells()));
    // A part of the world is stored more finely.
    const int coarse = 2 + i % 3;
    const auto isStored = [&](TileId id) { return id.level <= coarse || id.col >> (id.level - coarse) == 1; };
    const size_t most = 4 + random() % 200;
    const std::vector<TileId> found = tilesAlong(lines, frame, isStored, most);
    ASSERT_FALSE(found.empty());
    ASSERT_TRUE(found.size() <= most || found.size() == 1);
    for (const TileId id : found) ASSERT_TRUE(isStored(id)) << toString(id);
    const std::set<TileId> unique(found.begin(), found.end());
    // Whatever the lines come into is found, or something that holds it or lies in it.
    for (TileId id : walked(lines, frame, coarse)) {
      bool isCovered = false;
      for (const TileId each : found) {
        const TileId &fine = each.level > id.level ? each : id, &wide = each.level > id.level ? id : each;
        const int down = fine.level - wide.level;
        isCovered |= fine.col >> down == wide.col && fine.row >> down == wide.row;
      }
      ASSERT_TRUE(isCovered) << toString(id);
    }
    if (found.size() * 16 >= most || walked(lines, frame, 0).empty()) continue;
    for (const TileId id : found) ASSERT_TRUE(id.level == 6 || (id.level == coarse && id.col != 1));
  }
}

/// A track of many places comes into the same tiles when it is thinned.
TEST(StudiedGround, ThinnedTracksComeIntoTheSameTiles) {
  const Frame frame = frameOf(4);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> turn(-0.3, 0.3);
  for (int i = 0; i < 50; ++i) {
    std::vector<glm::dvec2> track = {{2000.0, 2000.0}};
    double heading = i;
    for (int step = 0; step < 3000; ++step) {
      heading += turn(random);
      track.push_back(track.back() + 3.0 * glm::dvec2(std::cos(heading), std::sin(heading)));
    }
    const std::vector<glm::dvec2> few = thinned(track, kTileCells);
    EXPECT_LT(few.size(), track.size() / 4);
    const auto tiles = [&](const std::vector<glm::dvec2>& line) {
      const std::vector<TileId> found = tilesAlong(
          {line}, frame, [](TileId) { return true; }, 100000);
      return std::set<TileId>(found.begin(), found.end());
    };
    ASSERT_EQ(tiles(few), tiles(track));
  }
}

TEST(StudiedGround, BesideTheWorldIsOnlyTheRoot) {
  const std::vector<TileId> found = tilesAlong(
      {{{-500.0, 10.0}, {-20.0, 90.0}}}, frameOf(3), [](TileId) { return true; }, 50);
  EXPECT_EQ(found, std::vector<TileId>{TileId{}});
}

}  // namespace
}  // namespace terrane
