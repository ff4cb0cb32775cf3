#include "terrane/render/ground_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <random>

#include "made_up_world.h"
#include "stage.h"

/// Lines on the ground against their definition: lines laid over the surface in steps of a hand's width, seen
/// by the camera.
namespace terrane {
namespace {

constexpr int kLinesWidth = 320;
constexpr int kLinesHeight = 200;
const PatchGrid kLinesGrid{.k = 4};

RenderStyle styleOfLines() {
  RenderStyle style;
  style.samples = 1;
  style.haze = false;
  style.lowMeters = 300.0;
  style.highMeters = 1700.0;
  return style;
}

std::vector<uint8_t> drawnWithLines(const Stage& stage, const Cut& cut, const MadeUpWorld& world,
                                    const Camera& camera, const RenderStyle& style) {
  auto picture = stage.renderer->drawPicture(cut, world.frame, camera, style);
  TERRANE_CHECK(picture.ok(), "{}", picture.error().message);
  return std::move(picture->rgba);
}

/// Winding lines all over the world.
std::vector<GroundLine> windingLines(const MadeUpWorld& world, uint32_t seed, int count) {
  std::mt19937 random(seed);
  const double side = world.sideMeters();
  std::uniform_real_distribution<double> place(0.05 * side, 0.95 * side), turn(-0.7, 0.7),
      length(10.0, 120.0);
  std::vector<GroundLine> out;
  for (int i = 0; i < count; ++i) {
    GroundLine line;
    glm::dvec2 at(place(random), -place(random));
    double heading = place(random);
    for (int k = 0; k < 25; ++k) {
      line.corners.push_back(at);
      heading += turn(random);
      const glm::dvec2 next = at + length(random) * glm::dvec2(std::cos(heading), std::sin(heading));
      if (next.x < 5.0 || next.x > side - 5.0 || next.y > -5.0 || next.y < 5.0 - side) break;
      at = next;
    }
    line.srgba = {1.0F, 0.0F, 1.0F, 1.0F};
    out.push_back(line);
  }
  return out;
}

struct Nearest {
  double seen = 1e9;  ///< to what the ground does not hide, at about the pixel's own depth
  double any = 1e9;
};
/// For each pixel how far the lines are away on the picture, in pixels.
std::vector<Nearest> nearestOnPicture(const MadeUpWorld& world, const std::vector<GroundLine>& lines,
                                      const Camera& camera, const std::vector<glm::dvec3>& places,
                                      double exaggeration) {
  std::vector<Nearest> out(places.size());
  const auto visit = [&](glm::dvec2 at) {
    const glm::dvec3 point(at, exaggeration * surfaceHeight(world, at, 1));
    const double depth = camera.viewFromLocal(point).z;
    if (depth < 1.0) return;
    const glm::dvec2 pixel = camera.pixelFromLocal(point);
    const int x = static_cast<int>(std::floor(pixel.x)), y = static_cast<int>(std::floor(pixel.y));
    for (int dy = -4; dy <= 4; ++dy)
      for (int dx = -4; dx <= 4; ++dx) {
        if (x + dx < 0 || x + dx >= camera.width || y + dy < 0 || y + dy >= camera.height) continue;
        const auto index = static_cast<size_t>((y + dy) * camera.width + x + dx);
        const double distance = glm::length(pixel - glm::dvec2(x + dx + 0.5, y + dy + 0.5));
        out[index].any = std::min(out[index].any, distance);
        if (std::isnan(places[index].x)) continue;
        const glm::dvec3 own(places[index].x, places[index].y, exaggeration * places[index].z);
        const double ownDepth = camera.viewFromLocal(own).z;
        if (std::abs(ownDepth - depth) < 0.02 * depth) out[index].seen = std::min(out[index].seen, distance);
      }
  };
  for (const GroundLine& line : lines)
    for (size_t i = 0; i < line.corners.size(); ++i) {
      const glm::dvec2 a = line.corners[i], b = line.corners[std::min(i + 1, line.corners.size() - 1)];
      const int steps = static_cast<int>(glm::length(b - a) / 0.2) + 1;
      for (int k = 0; k <= steps; ++k) visit(a + (b - a) * (static_cast<double>(k) / steps));
    }
  return out;
}

TEST(GroundLines, ArePixelsWideWhereverTheGroundIsSeen) {
  const MadeUpWorld world = hillsWorld(1);
  const double side = world.sideMeters();
  const Cut cut = makeFullCut(kLinesGrid, 1, kLinesGrid.deepestLevel(1));
  for (const gpu::Api api : {gpu::Api::OpenGl, gpu::Api::OpenGlEs}) {
    const Stage stage({.api = api});
    stage.uploadAll(world, 1);
    int number = 0;
    for (const auto& [eye, target, exaggeration] : std::vector<std::tuple<glm::dvec3, glm::dvec3, double>>{
             {{0.5 * side, -0.5 * side, 2600.0}, {0.5 * side, -0.499 * side, 0.0}, 1.0},
             {{0.5 * side, -1.05 * side, 2500.0}, {0.45 * side, -0.5 * side, 500.0}, 1.0},
             {{0.3 * side, -0.9 * side, 1500.0}, {0.5 * side, -0.2 * side, 900.0}, 1.0},
             {{0.3 * side, -0.9 * side, 2600.0}, {0.5 * side, -0.2 * side, 1600.0}, 2.0}}) {
      const Camera camera = lookAt(eye, target, 0.8, kLinesWidth, kLinesHeight);
      RenderStyle style = styleOfLines();
      style.exaggeration = exaggeration;
      const auto lines = windingLines(world, 3, 25);
      const auto bare = drawnWithLines(stage, cut, world, camera, style);
      ASSERT_TRUE(stage.renderer->setLines(lines).ok());
      const auto lined = drawnWithLines(stage, cut, world, camera, style);
      look("lines_" + std::to_string(number++), lined, kLinesWidth, kLinesHeight);
      const auto places = stage.renderer->drawPositions(cut, world.frame, camera, exaggeration);
      ASSERT_TRUE(places.ok());
      const auto nearest = nearestOnPicture(world, lines, camera, *places, exaggeration);
      int inside = 0, missing = 0, outside = 0, extra = 0;
      for (size_t i = 0; i < nearest.size(); ++i) {
        const bool isFull = lined[4 * i] > 245 && lined[4 * i + 1] < 20 && lined[4 * i + 2] > 245;
        const bool isBare =
            std::abs(lined[4 * i] - bare[4 * i]) < 3 && std::abs(lined[4 * i + 1] - bare[4 * i + 1]) < 3;
        if (nearest[i].seen < 0.75) {
          ++inside;
          missing += isFull ? 0 : 1;
        }
        if (nearest[i].any > 2.3) {
          ++outside;
          extra += isBare ? 0 : 1;
        }
      }
      std::printf("%d pixels of lines, %d missing; %d beside, %d too many\n", inside, missing, outside,
                  extra);
      EXPECT_GT(inside, 500);
      EXPECT_GT(outside, 20000);
      // Seen from above, exact. Where the ground folds away, a pixel knows only what it and its neighbours
      // see of the fold: one in fifty there is fainter than it should be, one in a thousand is too many.
      EXPECT_LE(missing, number == 1 ? 0 : inside / 50);
      EXPECT_LE(extra, number == 1 ? 0 : outside / 1000);
      ASSERT_TRUE(stage.renderer->setLines({}).ok());
      EXPECT_EQ(drawnWithLines(stage, cut, world, camera, style), bare);
    }
  }
}

TEST(GroundLines, MetersAreMetersOnTheGround) {
  const MadeUpWorld world = hillsWorld(1);
  const double side = world.sideMeters();
  const Cut cut = makeFullCut(kLinesGrid, 1, kLinesGrid.deepestLevel(1));
  const Stage stage;
  stage.uploadAll(world, 1);
  const Camera camera = lookAt({0.5 * side, -1.05 * side, 2500.0}, {0.45 * side, -0.5 * side, 500.0}, 0.8,
                               kLinesWidth, kLinesHeight);
  const auto bare = drawnWithLines(stage, cut, world, camera, styleOfLines());
  const auto places = stage.renderer->drawPositions(cut, world.frame, camera);
  ASSERT_TRUE(places.ok());
  for (const double width : {20.0, 60.0, 400.0}) {
    auto lines = windingLines(world, 4, 8);
    for (GroundLine& line : lines) line.isWidthInMeters = true, line.width = width;
    ASSERT_TRUE(stage.renderer->setLines(lines).ok());
    const auto lined = drawnWithLines(stage, cut, world, camera, styleOfLines());
    look("meters_" + std::to_string(static_cast<int>(width)), lined, kLinesWidth, kLinesHeight);
    int inside = 0, missing = 0, outside = 0, extra = 0;
    for (size_t i = 0; i < places->size(); ++i) {
      const glm::dvec3 place = (*places)[i];
      if (std::isnan(place.x)) continue;
      double meters = 1e9;
      for (const GroundLine& line : lines)
        for (size_t k = 0; k + 1 < line.corners.size(); ++k) {
          const glm::dvec2 a = line.corners[k], along = line.corners[k + 1] - a;
          const double t =
              std::clamp(glm::dot(glm::dvec2(place) - a, along) / glm::dot(along, along), 0.0, 1.0);
          meters = std::min(meters, glm::length(glm::dvec2(place) - a - t * along));
        }
      // A pixel covers so much of the ground, at most.
      const double distance = glm::length(place - camera.eyeLocal);
      const double pixel = distance / camera.pixelsPerTangent() / 0.08;
      const bool isFull = lined[4 * i] > 245 && lined[4 * i + 1] < 20 && lined[4 * i + 2] > 245;
      const bool isBare =
          std::abs(lined[4 * i] - bare[4 * i]) < 3 && std::abs(lined[4 * i + 1] - bare[4 * i + 1]) < 3;
      if (meters < 0.5 * width - pixel) ++inside, missing += isFull ? 0 : 1;
      if (meters > 0.5 * width + pixel) ++outside, extra += isBare ? 0 : 1;
    }
    EXPECT_GT(outside, 1000);
    EXPECT_GT(inside, width > 100.0 ? 200 : -1);
    EXPECT_EQ(missing, 0) << width << " of " << inside;
    EXPECT_LE(extra, outside / 2000) << width;
  }
}

TEST(GroundLines, LaterOnesLieOverEarlierOnesAndBlendOnce) {
  MadeUpWorld world = hillsWorld(0);
  world.height = [](int64_t, int64_t) { return 0.0F; };
  const Stage stage;
  stage.uploadAll(world, 0);
  const Cut cut = makeFullCut(kLinesGrid, 0, kLinesGrid.deepestLevel(0));
  const double side = world.sideMeters(), middle = 0.5 * side;
  const Camera camera =
      lookAt({middle, -middle, 1000.0}, {middle, -middle, 0.0}, 0.7, kLinesWidth, kLinesHeight);
  const auto at = [&](const std::vector<uint8_t>& rgba, glm::dvec2 local) {
    const glm::dvec2 pixel = camera.pixelFromLocal({local, 0.0});
    const size_t i = 4 * (static_cast<size_t>(pixel.y) * kLinesWidth + static_cast<size_t>(pixel.x));
    return std::array<int, 3>{rgba[i], rgba[i + 1], rgba[i + 2]};
  };
  GroundLine red, green;
  red.corners = {{middle - 100.0, -middle}, {middle + 100.0, -middle}};
  green.corners = {{middle, -middle - 100.0}, {middle, -middle + 100.0}};
  red.srgba = {1, 0, 0, 1};
  green.srgba = {0, 1, 0, 1};
  red.width = green.width = 9.0;
  ASSERT_TRUE(stage.renderer->setLines(std::vector<GroundLine>{red, green}).ok());
  EXPECT_EQ(at(drawnWithLines(stage, cut, world, camera, styleOfLines()), {middle, -middle})[1], 255);
  ASSERT_TRUE(stage.renderer->setLines(std::vector<GroundLine>{green, red}).ok());
  const auto crossed = drawnWithLines(stage, cut, world, camera, styleOfLines());
  EXPECT_EQ(at(crossed, {middle, -middle})[0], 255);
  EXPECT_EQ(at(crossed, {middle, -middle + 50.0})[1], 255);

  // A see-through line is no denser where its legs overlap.
  GroundLine bent = red;
  bent.srgba = {1, 0, 0, 0.5F};
  bent.corners = {{middle - 100.0, -middle}, {middle, -middle}, {middle - 100.0, -middle + 0.1}};
  ASSERT_TRUE(stage.renderer->setLines(std::vector<GroundLine>{bent}).ok());
  const auto see = drawnWithLines(stage, cut, world, camera, styleOfLines());
  ASSERT_TRUE(stage.renderer->setLines(std::vector<GroundLine>{}).ok());
  const auto bare = drawnWithLines(stage, cut, world, camera, styleOfLines());
  const auto before = at(bare, {middle - 50.0, -middle}), after = at(see, {middle - 50.0, -middle});
  const auto linear = [](int c) { return std::pow(c / 255.0, 2.2); };
  EXPECT_NEAR(linear(after[1]), 0.5 * linear(before[1]), 0.02);
  EXPECT_NEAR(linear(after[0]), 0.5 * linear(before[0]) + 0.5, 0.02);
  // A dot is round, and as wide as it should be.
  GroundLine dot = red;
  dot.corners = {{middle + 20.0, -middle + 20.0}};
  dot.width = 21.0;
  ASSERT_TRUE(stage.renderer->setLines(std::vector<GroundLine>{dot}).ok());
  const auto dotted = drawnWithLines(stage, cut, world, camera, styleOfLines());
  double area = 0.0;
  for (size_t i = 0; i < dotted.size(); i += 4)
    if (dotted[i] != bare[i] || dotted[i + 1] != bare[i + 1])
      area += (linear(bare[i + 1]) - linear(dotted[i + 1])) / linear(bare[i + 1]);
  EXPECT_NEAR(area, 3.14159 * 10.5 * 10.5, 8.0);
}

/// At a metre's distance, in a world as large as a country: no line trembles.
TEST(GroundLines, StandStillInALargeWorld) {
  MadeUpWorld world = hillsWorld(8, 8.0);
  world.height = [](int64_t, int64_t) { return 0.0F; };
  const Stage stage;
  const PatchGrid grid{.k = 4};
  const Cut cut = makeFullCut(grid, 0, 2);
  ASSERT_TRUE(stage.renderer->uploadTile({0, 0, 0}, world.tile({0, 0, 0})).ok());
  const glm::dvec2 at(391234.567, -287654.321);
  GroundLine line;
  line.corners = {at - glm::dvec2(3000.0, 1000.0), at + glm::dvec2(3000.0, 1000.0)};
  line.srgba = {1, 0, 1, 1};
  line.width = 5.0;
  ASSERT_TRUE(stage.renderer->setLines(std::vector<GroundLine>{line}).ok());
  Cut deep = cut;
  deep.latticeDepth = 8;
  deep = makeFullCut(grid, 8, 2);
  for (Patch& patch : deep.patches) patch.tile = patch.shadingTile = TileId{};
  for (int i = 0; i < 20; ++i) {
    const glm::dvec2 eye = at + 0.37 * i * glm::normalize(glm::dvec2(3.0, 1.0));
    const Camera camera = lookAt({eye, 2.0}, {eye, 0.0}, 0.7, kLinesWidth, kLinesHeight);
    const auto picture = drawnWithLines(stage, deep, world, camera, styleOfLines());
    // The line goes through the middle, and is five pixels wide there.
    double area = 0.0;
    for (int y = 0; y < kLinesHeight; ++y)
      area += picture[4 * static_cast<size_t>(y * kLinesWidth + kLinesWidth / 2)] > 200 &&
              picture[4 * static_cast<size_t>(y * kLinesWidth + kLinesWidth / 2) + 1] < 100;
    const size_t middle = 4 * static_cast<size_t>(kLinesHeight / 2 * kLinesWidth + kLinesWidth / 2);
    EXPECT_GT(picture[middle], 240) << i;
    EXPECT_LT(picture[middle + 1], 30) << i;
    EXPECT_NEAR(area, 5.0 * std::sqrt(10.0) / 3.0, 1.5) << i;
  }
}

TEST(GroundLines, TenThousandSegmentsCostLittleMoreThanOne) {
  const MadeUpWorld world = hillsWorld(2);
  const double side = world.sideMeters();
  const Stage stage;
  stage.uploadAll(world, 2);
  const Cut cut = makeFullCut(kLinesGrid, 2, kLinesGrid.deepestLevel(1));
  const Camera camera =
      lookAt({0.5 * side, -1.05 * side, 3500.0}, {0.45 * side, -0.5 * side, 500.0}, 0.8, 640, 400);
  const auto seconds = [&] {
    double best = 1e9;
    for (int i = 0; i < 5; ++i) {
      const auto begun = std::chrono::steady_clock::now();
      drawnWithLines(stage, cut, world, camera, styleOfLines());
      best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
    }
    return best;
  };
  const double bare = seconds();
  const auto many = windingLines(world, 5, 700);
  size_t segments = 0;
  for (const GroundLine& line : many) segments += line.corners.size() - 1;
  EXPECT_GT(segments, 10000U);
  ASSERT_TRUE(stage.renderer->setLines(std::vector<GroundLine>{many[0]}).ok());
  const double one = seconds();
  ASSERT_TRUE(stage.renderer->setLines(many).ok());
  const double all = seconds();
  look("ten_thousand", drawnWithLines(stage, cut, world, camera, styleOfLines()), 640, 400);
  std::printf("frame %.1f ms, with one line %.2f times, with %zu segments %.2f times\n", 1e3 * bare,
              one / bare, segments, all / bare);
  EXPECT_LT(all, 4.0 * one);
}

}  // namespace
}  // namespace terrane
