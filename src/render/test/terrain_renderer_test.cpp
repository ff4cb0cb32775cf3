#include "terrane/render/terrain_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "made_up_world.h"
#include "shader_library.h"
#include "stage.h"

namespace terrane {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 200;
const PatchGrid kGrid{.k = 4};

/// Straight down onto part of the world: all that is in view is ground.
Camera downOnto(const MadeUpWorld& world, double shareX, double shareY, double heightMeters) {
  const double side = world.sideMeters();
  return lookAt({shareX * side, -shareY * side, heightMeters}, {shareX * side, -shareY * side, 0.0}, 0.7,
                kWidth, kHeight);
}
/// From the south, at a slope.
Camera across(const MadeUpWorld& world, double heightMeters) {
  const double side = world.sideMeters();
  return lookAt({0.5 * side, -1.1 * side, heightMeters}, {0.45 * side, -0.5 * side, 500.0}, 0.8, kWidth,
                kHeight);
}

RenderStyle plainStyle() {
  RenderStyle style;
  style.samples = 1;
  style.lowMeters = 300.0;
  style.highMeters = 1700.0;
  return style;
}

/// The largest difference of any channel, and how many pixels differ by more than `tolerance`.
struct Difference {
  int largest = 0;
  int pixels = 0;
};
Difference compare(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b, int tolerance) {
  Difference out;
  EXPECT_EQ(a.size(), b.size());
  for (size_t i = 0; i + 3 < std::min(a.size(), b.size()); i += 4) {
    int worst = 0;
    for (size_t c = 0; c < 4; ++c) worst = std::max(worst, std::abs(a[i + c] - b[i + c]));
    out.largest = std::max(out.largest, worst);
    out.pixels += worst > tolerance;
  }
  return out;
}

std::vector<uint8_t> drawn(const Stage& stage, const Cut& cut, const MadeUpWorld& world, const Camera& camera,
                           const RenderStyle& style) {
  auto picture = stage.renderer->drawPicture(cut, world.frame, camera, style);
  TERRANE_CHECK(picture.ok(), "{}", picture.error().message);
  return std::move(picture->rgba);
}

TEST(Shaders, AllCompileInBothDialects) {
  for (const gpu::Api api : {gpu::Api::OpenGl, gpu::Api::OpenGlEs}) {
    auto context = gpu::Context::createHeadless({.api = api});
    ASSERT_TRUE(context.ok()) << context.error().message;
    const ProgramRecipes all;
    std::vector<std::string_view> used;
    for (const ProgramRecipe* recipe :
         {&all.shade, &all.position, &all.meshShade, &all.meshPosition, &all.meshLine, &all.sky, &all.present,
          &all.line, &all.shrink, &all.groundLines}) {
      const auto program = makeProgram(**context, *recipe);
      EXPECT_TRUE(program.ok()) << program.error().message;
      used.insert(used.end(), recipe->vertex.begin(), recipe->vertex.end());
      used.insert(used.end(), recipe->fragment.begin(), recipe->fragment.end());
    }
    // Passes are compiled where a caller's text is between their files.
    used.insert(used.end(), all.groundPass.fragment.begin(), all.groundPass.fragment.end());
    for (const gpu::ShaderFile& file : shaderFiles()) {
      // Those that compute are for desktop OpenGL alone, and have tests of their own.
      if (file.name.ends_with(".comp")) continue;
      EXPECT_NE(std::find(used.begin(), used.end(), file.name), used.end())
          << file.name << " is in no program";
    }
  }
}

TEST(TerrainRenderer, PositionsLieOnTheDrawnSurface) {
  const MadeUpWorld world = hillsWorld(1);
  for (const gpu::Api api : {gpu::Api::OpenGl, gpu::Api::OpenGlEs}) {
    const Stage stage({.api = api});
    stage.uploadAll(world, 1);
    // Right-angle patches of the finest level: their triangles are the finest cells, cut as surfaceHeight
    // does.
    const Cut cut = makeFullCut(kGrid, 1, kGrid.deepestLevel(1));
    for (const Camera& camera :
         {downOnto(world, 0.5, 0.5, 2600.0), across(world, 2500.0), downOnto(world, 0.3, 0.7, 1800.0)}) {
      const auto positions = stage.renderer->drawPositions(cut, world.frame, camera);
      ASSERT_TRUE(positions.ok()) << positions.error().message;
      ASSERT_EQ(positions->size(), static_cast<size_t>(kWidth * kHeight));
      std::vector<double> offSurface;
      double worstOnScreen = 0.0;
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const glm::dvec3 place = (*positions)[static_cast<size_t>(y * kWidth + x)];
          if (std::isnan(place.x)) continue;
          const double distance = glm::length(place - camera.eyeLocal);
          offSurface.push_back(std::abs(place.z - surfaceHeight(world, {place.x, place.y}, 1)) / distance);
          worstOnScreen = std::max(worstOnScreen, offSurface.back() * camera.pixelsPerTangent());
          const glm::dvec2 pixel = camera.pixelFromLocal(place);
          ASSERT_LT(glm::length(pixel - glm::dvec2(x + 0.5, y + 0.5)), 1e-6);
        }
      ASSERT_GT(offSurface.size(), static_cast<size_t>(kWidth * kHeight / 4));
      std::sort(offSurface.begin(), offSurface.end());
      const double median = offSurface[offSurface.size() / 2];
      const double most = offSurface[offSurface.size() * 99 / 100];
      std::printf("off the surface, in distances: median 2^%.1f, 99 of 100 2^%.1f; at most %.4f pixels\n",
                  std::log2(median), std::log2(most), worstOnScreen);
      EXPECT_LT(median, 0x1p-22);
      EXPECT_LT(most, 0x1p-18);
      // Where triangles fold away from the eye, rasterisers count pixels to them that lie 1/256 pixel
      // outside.
      EXPECT_LT(worstOnScreen, 0.02);
    }
  }
}

TEST(TerrainRenderer, PositionsLieOnTheMorphedSurface) {
  const MadeUpWorld world = hillsWorld(1);
  // The finest triangulation with every other vertex half way to the mean of its hypotenuse's ends.
  MadeUpWorld halfWay = world;
  halfWay.height = [](int64_t x, int64_t y) {
    const float own = hillsHeight(x, y);
    if ((x + y) % 2 == 0) return own;
    const int dx = x % 2 != 0 ? 1 : 0;
    const int dy = 1 - dx;
    return 0.5F * own + 0.25F * (hillsHeight(x - dx, y - dy) + hillsHeight(x + dx, y + dy));
  };
  struct Case {
    int level;
    float morph;
    const MadeUpWorld& surface;
    int step;
  };
  // Hypotenuse patches at morph 0 show the right-angle ones of twice the spacing.
  const int finest = kGrid.deepestLevel(1);
  const std::array<Case, 2> cases = {{{finest, 0.5F, halfWay, 1}, {finest - 1, 0.0F, world, 2}}};
  const Stage stage;
  stage.uploadAll(world, 1);
  for (const Case& each : cases) {
    Cut cut = makeFullCut(kGrid, 1, each.level);
    for (Patch& patch : cut.patches) patch.morph = each.morph;
    const Camera camera = downOnto(world, 0.45, 0.5, 2600.0);
    const auto positions = stage.renderer->drawPositions(cut, world.frame, camera);
    ASSERT_TRUE(positions.ok()) << positions.error().message;
    int ground = 0;
    double worst = 0.0;
    for (const glm::dvec3& place : *positions) {
      if (std::isnan(place.z)) continue;
      ++ground;
      const double distance = glm::length(place - camera.eyeLocal);
      const double off =
          std::abs(place.z - surfaceHeight(each.surface, {place.x, place.y}, each.step)) / distance;
      worst = std::max(worst, off * camera.pixelsPerTangent());
    }
    EXPECT_GT(ground, kWidth * kHeight / 2);
    EXPECT_LT(worst, 0.02) << "level " << each.level;
  }
}

TEST(TerrainRenderer, PositionsTakeExaggerationOut) {
  const MadeUpWorld world = hillsWorld(0);
  const Stage stage;
  stage.uploadAll(world, 0);
  const Cut cut = makeFullCut(kGrid, 0, kGrid.deepestLevel(0));
  const Camera camera = downOnto(world, 0.5, 0.5, 4200.0);
  const auto positions = stage.renderer->drawPositions(cut, world.frame, camera, 2.5);
  ASSERT_TRUE(positions.ok());
  int ground = 0;
  for (const glm::dvec3& place : *positions) {
    if (std::isnan(place.z)) continue;
    ++ground;
    ASSERT_NEAR(place.z, surfaceHeight(world, {place.x, place.y}, 1), 0.02);
  }
  EXPECT_GT(ground, 1000);
}

TEST(TerrainRenderer, NoBackgroundShowsThroughCoveringGround) {
  const MadeUpWorld world = hillsWorld(2);
  const Stage stage;
  stage.uploadAll(world, 2);
  const Lattice lattice(2);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0.35, 0.65);
  for (int round = 0; round < 10; ++round) {
    const glm::dvec2 focus{share(random) * 1024.0, share(random) * 1024.0};
    // Mixed levels, so that patches of all sizes meet.
    Cut cut = makeCut(kGrid, 2, kGrid.deepestLevel(2), [&](const Diamond& d) {
      return d.level < 3 || std::hypot(d.x - focus.x, d.y - focus.y) < 5.0 * lattice.halfSize(d.level);
    });
    if (round % 2 != 0) morphAtRandom(cut, random);
    const Camera camera =
        lookAt({10.0 * focus.x, -10.0 * focus.y, 2000.0},
               {10.0 * share(random) * 1024.0, -10.0 * share(random) * 1024.0, 0.0}, 0.6, kWidth, kHeight);
    if (camera.forward.z > -0.75) continue;
    const auto positions = stage.renderer->drawPositions(cut, world.frame, camera);
    ASSERT_TRUE(positions.ok()) << positions.error().message;
    const auto sky = std::count_if(positions->begin(), positions->end(),
                                   [](const glm::dvec3& p) { return std::isnan(p.x); });
    EXPECT_EQ(sky, 0) << "round " << round;
  }
}

TEST(TerrainRenderer, CoverageDiscardsExactlyItsCells) {
  MadeUpWorld world = hillsWorld(1);
  world.height = [](int64_t, int64_t) { return 100.0F; };
  world.ground = [](int64_t x, int64_t y) { return ((x / 3) ^ (y / 5)) % 4 != 1; };
  for (const gpu::Api api : {gpu::Api::OpenGl, gpu::Api::OpenGlEs}) {
    const Stage stage({.api = api});
    stage.uploadAll(world, 1);
    // Coarse geometry whose coverage comes from the finer tiles below it.
    Cut cut = makeFullCut(kGrid, 1, kGrid.deepestLevel(0));
    const Lattice lattice(1);
    for (Patch& patch : cut.patches) {
      EXPECT_EQ(patch.tile, (TileId{0, 0, 0}));
      patch.shadingTile = lattice.tileOf(patch.triangle, 1);
    }
    const Camera camera = downOnto(world, 0.52, 0.47, 900.0);
    const auto positions = stage.renderer->drawPositions(cut, world.frame, camera);
    ASSERT_TRUE(positions.ok()) << positions.error().message;
    int ground = 0;
    int holes = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        // Where the pixel's ray meets the flat ground tells what must be seen.
        const glm::dvec3 ray = camera.rayThroughPixel({x + 0.5, y + 0.5});
        const glm::dvec3 hit = camera.eyeLocal + ray * ((100.0 - camera.eyeLocal.z) / ray.z);
        const glm::dvec2 sample = world.frame.sampleFromLocal({hit.x, hit.y});
        const glm::dvec2 toEdge = glm::abs(sample - glm::round(sample));
        if (std::min(toEdge.x, toEdge.y) < 1e-3) continue;
        const bool expected = world.ground(static_cast<int64_t>(std::floor(sample.x)),
                                           static_cast<int64_t>(std::floor(sample.y)));
        const bool seen = !std::isnan((*positions)[static_cast<size_t>(y * kWidth + x)].x);
        ASSERT_EQ(seen, expected) << x << " " << y;
        ++(expected ? ground : holes);
      }
    EXPECT_GT(ground, 1000);
    EXPECT_GT(holes, 1000);
  }
}

TEST(TerrainRenderer, BothDialectsAndBothDepthsDrawTheSame) {
  const MadeUpWorld world = hillsWorld(1);
  const Cut cut = makeFullCut(kGrid, 1, kGrid.deepestLevel(1) - 4);
  const Camera camera = across(world, 2000.0);
  constexpr int kOutlines = 3;
  std::vector<std::vector<std::vector<uint8_t>>> pictures;
  for (const gpu::ContextOptions& options :
       {gpu::ContextOptions{}, gpu::ContextOptions{.api = gpu::Api::OpenGlEs},
        gpu::ContextOptions{.api = gpu::Api::OpenGlEs, .forbidClipControl = true}}) {
    const Stage stage(options);
    stage.uploadAll(world, 1);
    auto& ofContext = pictures.emplace_back();
    for (const ColorMode mode : {ColorMode::Shaded, ColorMode::Height, ColorMode::Slope, ColorMode::Normals,
                                 ColorMode::Tiles, ColorMode::Error})
      for (int outline = 0; outline < kOutlines; ++outline) {
        RenderStyle style = plainStyle();
        style.mode = mode;
        style.outline = static_cast<OutlineMode>(outline);
        ofContext.push_back(drawn(stage, cut, world, camera, style));
      }
  }
  for (size_t i = 0; i < pictures[0].size(); ++i) {
    const Difference dialects = compare(pictures[0][i], pictures[1][i], 2);
    EXPECT_LE(dialects.pixels, 4) << "picture " << i << " largest " << dialects.largest;
    // Ordinary depth decides a few pixels at silhouettes otherwise.
    const Difference depths = compare(pictures[0][i], pictures[2][i], 2);
    EXPECT_LE(depths.pixels, 40) << "picture " << i << " largest " << depths.largest;
    // No two modes look the same.
    for (size_t other = 0; other < i; ++other)
      EXPECT_GT(compare(pictures[0][i], pictures[0][other], 8).pixels, 200) << i << " " << other;
  }
}

TEST(TerrainRenderer, OutlinesAreThinAndWhereTheyBelong) {
  MadeUpWorld world = hillsWorld(1);
  world.height = [](int64_t, int64_t) { return 0.0F; };
  const Stage stage;
  stage.uploadAll(world, 1);
  const Camera camera = downOnto(world, 0.37, 0.41, 1000.0);
  for (const int level : {kGrid.deepestLevel(0), kGrid.deepestLevel(0) + 1}) {
    const Cut cut = makeFullCut(kGrid, 1, level);
    RenderStyle style = plainStyle();
    const auto plain = drawn(stage, cut, world, camera, style);
    style.outline = OutlineMode::Patches;
    const auto patches = compare(plain, drawn(stage, cut, world, camera, style), 10);
    style.outline = OutlineMode::Wireframe;
    const auto wireframe = compare(plain, drawn(stage, cut, world, camera, style), 10);
    EXPECT_GT(patches.pixels, kWidth);
    EXPECT_GT(wireframe.pixels, 3 * patches.pixels);
    EXPECT_LT(wireframe.pixels, kWidth * kHeight * 3 / 4);
  }
}

TEST(TerrainRenderer, SamplesSmoothEdgesThatTheMaskMakes) {
  MadeUpWorld world = hillsWorld(1);
  world.height = [](int64_t, int64_t) { return 0.0F; };
  world.ground = [](int64_t x, int64_t y) { return 3 * x > 2 * y + 128; };
  const Stage stage;
  stage.uploadAll(world, 1);
  const Cut cut = makeFullCut(kGrid, 1, kGrid.deepestLevel(1));
  const Camera camera = downOnto(world, 0.5, 0.5, 3000.0);
  RenderStyle style = plainStyle();
  style.mode = ColorMode::Normals;
  style.haze = false;
  // Flat ground has one colour and the sky nearly one: more samples leave more colours between them.
  const auto between = [&](int samples) {
    style.samples = samples;
    auto picture = stage.renderer->drawPicture(cut, world.frame, camera, style);
    TERRANE_CHECK(picture.ok(), "{}", picture.error().message);
    EXPECT_GE(picture->statistics.samples, samples);
    // Left is sky, right is ground; the sky's colour changes slowly.
    const auto& rgba = picture->rgba;
    int count = 0;
    for (size_t row = 0; row < rgba.size(); row += 4 * kWidth)
      for (size_t i = row; i < row + 4 * kWidth; i += 4) {
        const int blue = rgba[i + 2];
        count += std::abs(blue - rgba[row + 2]) > 12 && std::abs(blue - rgba[row + 4 * kWidth - 2]) > 12;
      }
    return count;
  };
  EXPECT_LT(between(1), 3);
  EXPECT_GT(between(4), 30);
  EXPECT_GT(between(16), 30);
}

TEST(TerrainRenderer, NeighboursAreLitWithoutASeam) {
  // The same smooth ground as one tile and as four: along the tiles' borders nothing may differ.
  MadeUpWorld world = hillsWorld(1, 40.0);
  world.height = [](int64_t x, int64_t y) {
    return static_cast<float>(1500.0 * std::sin(static_cast<double>(x) * 0.021) *
                              std::cos(static_cast<double>(y) * 0.017));
  };
  const Camera camera = downOnto(world, 0.5, 0.5, 6000.0);
  RenderStyle style = plainStyle();
  style.mode = ColorMode::Normals;
  style.haze = false;
  const Stage stage;
  stage.uploadAll(world, 1);
  const Cut cut = makeFullCut(kGrid, 1, kGrid.deepestLevel(1));
  const auto picture = drawn(stage, cut, world, camera, style);
  // Magnified about four times, colours change slowly everywhere: a step between pixels would be a seam.
  int largestStep = 0;
  int largestAtSeam = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 1; x < kWidth; ++x) {
      const size_t at = static_cast<size_t>(y * kWidth + x) * 4;
      const int step = std::abs(picture[at] - picture[at - 4]);
      largestStep = std::max(largestStep, step);
      if (std::abs(x - kWidth / 2) <= 1) largestAtSeam = std::max(largestAtSeam, step);
    }
  EXPECT_GT(largestStep, 0);
  EXPECT_LE(largestAtSeam, 4);
  EXPECT_LE(largestStep, 5);

  // Without its neighbours a tile's border is lit by its own side: dropping and uploading changes it back.
  stage.renderer->dropTile({1, 1, 0});
  EXPECT_FALSE(stage.renderer->hasTile({1, 1, 0}));
  EXPECT_FALSE(stage.renderer->drawPicture(cut, world.frame, camera, style).ok());
  ASSERT_TRUE(stage.renderer->uploadTile({1, 1, 0}, world.tile({1, 1, 0})).ok());
  EXPECT_EQ(compare(picture, drawn(stage, cut, world, camera, style), 0).pixels, 0);
}

TEST(TerrainRenderer, StatisticsCountWhatIsDrawn) {
  const MadeUpWorld world = hillsWorld(1);
  const Stage stage;
  stage.uploadAll(world, 1);
  EXPECT_EQ(stage.renderer->tileCount(), 5U);
  EXPECT_GT(stage.renderer->gpuBytes(), 5U * 600'000U);
  const Cut cut = makeFullCut(kGrid, 1, kGrid.deepestLevel(1) - 1);
  const auto picture = stage.renderer->drawPicture(cut, world.frame, across(world, 2000.0), plainStyle());
  ASSERT_TRUE(picture.ok());
  EXPECT_EQ(picture->statistics.patches, static_cast<int64_t>(cut.patches.size()));
  EXPECT_EQ(picture->statistics.triangles, picture->statistics.patches * 256);
  EXPECT_EQ(picture->statistics.tiles, 4);
  EXPECT_EQ(picture->statistics.drawCalls, 1);
  // Mixed levels take both templates.
  const Lattice lattice(1);
  const Cut mixed = makeCut(kGrid, 1, kGrid.deepestLevel(1),
                            [&](const Diamond& d) { return d.x + d.y < 6 * lattice.halfSize(d.level) + 40; });
  const auto both = stage.renderer->drawPicture(mixed, world.frame, across(world, 2000.0), plainStyle());
  ASSERT_TRUE(both.ok());
  EXPECT_EQ(both->statistics.drawCalls, 2);
}

TEST(TerrainRenderer, FrustumOfAnotherCameraIsDrawnOverTheScene) {
  const MadeUpWorld world = hillsWorld(0);
  const Stage stage;
  stage.uploadAll(world, 0);
  const Cut cut = makeFullCut(kGrid, 0, kGrid.deepestLevel(0));
  const Camera camera = across(world, 2500.0);
  RenderStyle style = plainStyle();
  const auto plain = drawn(stage, cut, world, camera, style);
  const double side = world.sideMeters();
  style.frustum = FrustumOverlay{
      lookAt({0.5 * side, -0.7 * side, 1500.0}, {0.5 * side, -0.2 * side, 600.0}, 0.6, 1280, 720),
      0.5 * side};
  const auto overlaid = compare(plain, drawn(stage, cut, world, camera, style), 20);
  EXPECT_GT(overlaid.pixels, 100);
  EXPECT_LT(overlaid.pixels, kWidth * kHeight / 8);
  // A camera inside its own frustum's lines must not spill over the picture either.
  style.frustum = FrustumOverlay{camera, 0.5 * side};
  EXPECT_LT(compare(plain, drawn(stage, cut, world, camera, style), 20).pixels, kWidth * kHeight / 8);
}

}  // namespace
}  // namespace terrane
