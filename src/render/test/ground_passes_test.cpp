#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>

#include "made_up_world.h"
#include "stage.h"

/// Callers' own stages over the finished ground.
namespace terrane {
namespace {

constexpr int kPassWidth = 320;
constexpr int kPassHeight = 200;
const PatchGrid kPassGrid{.k = 4};

RenderStyle styleOfPasses() {
  RenderStyle style;
  style.samples = 1;
  style.lowMeters = 300.0;
  style.highMeters = 1700.0;
  return style;
}

constexpr const char* kNothing = "vec3 apply(Ground ground) { return ground.color; }";
/// Contour lines, as docs/web.md has them.
constexpr const char* kContours = R"(uniform float interval;
uniform vec3 ink;
vec3 apply(Ground ground) {
  if (!ground.isGround) return ground.color;
  float at = ground.place.z / interval;
  float perPixel = max(fwidth(at), 1e-6);
  float pixels = abs(fract(at - 0.5) - 0.5) / perPixel;
  float share = clamp(1.2 - pixels, 0.0, 1.0) * clamp(1.0 - 2.0 * perPixel, 0.0, 1.0);
  return mix(ground.color, ink, share);
})";

struct Scene {
  MadeUpWorld world = hillsWorld(1);
  Cut cut = makeFullCut(kPassGrid, 1, kPassGrid.deepestLevel(1));
  Camera camera =
      lookAt({0.5 * world.sideMeters(), -1.05 * world.sideMeters(), 2500.0},
             {0.45 * world.sideMeters(), -0.5 * world.sideMeters(), 500.0}, 0.8, kPassWidth, kPassHeight);
  Stage stage;
  explicit Scene(gpu::Api api = gpu::Api::OpenGl) : stage({.api = api}) { stage.uploadAll(world, 1); }
  std::vector<uint8_t> draw(const RenderStyle& style = styleOfPasses()) const {
    auto picture = stage.renderer->drawPicture(cut, world.frame, camera, style);
    TERRANE_CHECK(picture.ok(), "{}", picture.error().message);
    return std::move(picture->rgba);
  }
  TerrainRenderer& renderer() const { return *stage.renderer; }
};

int worstDifference(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  int worst = 0;
  for (size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

TEST(GroundPasses, OneThatChangesNothingChangesNothing) {
  for (const gpu::Api api : {gpu::Api::OpenGl, gpu::Api::OpenGlEs}) {
    const Scene scene(api);
    for (const int samples : {1, 4}) {
      RenderStyle style = styleOfPasses();
      style.samples = samples;
      const auto bare = scene.draw(style);
      ASSERT_TRUE(scene.renderer().setPass("nothing", kNothing, {}).ok());
      EXPECT_LE(worstDifference(scene.draw(style), bare), 1);
      scene.renderer().removePass("nothing");
      scene.renderer().removePass("never there");
      EXPECT_EQ(scene.draw(style), bare);
    }
  }
}

/// Each member of Ground, written out as a colour, is what the CPU says it is.
TEST(GroundPasses, GroundIsWhatItSays) {
  for (const gpu::Api api : {gpu::Api::OpenGl, gpu::Api::OpenGlEs}) {
    for (const double exaggeration : {1.0, 2.0}) {
      const Scene scene(api);
      RenderStyle style = styleOfPasses();
      style.exaggeration = exaggeration;
      const auto places =
          scene.renderer().drawPositions(scene.cut, scene.world.frame, scene.camera, exaggeration);
      ASSERT_TRUE(places.ok());
      const glm::dvec3 origin(1200.0, -900.0, 350.0);
      // A number between 0 and 1 becomes a byte, whatever is done for the eye.
      const std::string bytes = R"(vec3 shown(vec3 c) {
  return mix(c / 12.92, pow((clamp(c, 0.0, 1.0) + 0.055) / 1.055, vec3(2.4)), step(vec3(0.04045), c));
}
)";
      const auto drawnBy = [&](const std::string& expression) {
        const Status set = scene.renderer().setPass(
            "look", bytes + "vec3 apply(Ground ground) { return shown(" + expression + "); }", origin);
        TERRANE_CHECK(set.ok(), "{}", set.error().message);
        return scene.draw(style);
      };
      const auto flags = drawnBy("vec3(ground.isGround ? 1.0 : 0.0)");
      const auto fractions = drawnBy("clamp(ground.place / 6000.0 + 0.5, 0.0, 1.0)");
      const auto eyes = drawnBy("clamp(ground.fromEye / 20000.0 + 0.5, 0.0, 1.0)");
      const auto far = drawnBy("vec3(ground.distance, ground.depth, 0.0) / 20000.0");
      const auto normals = drawnBy("ground.normal * 0.5 + 0.5");
      int ground = 0, sky = 0, offNormals = 0;
      for (size_t i = 0; i < places->size(); ++i) {
        const glm::dvec3 place = (*places)[i];
        const bool isGround = !std::isnan(place.x);
        ASSERT_EQ(flags[4 * i] > 128, isGround);
        if (!isGround) {
          ++sky;
          EXPECT_NEAR(normals[4 * i + 2], 255, 1);
          EXPECT_EQ(far[4 * i], 255);
          continue;
        }
        ++ground;
        const auto near = [&](const std::vector<uint8_t>& rgba, size_t c, double share) {
          ASSERT_NEAR(rgba[4 * i + c], 255.0 * std::clamp(share, 0.0, 1.0), 1.6) << i << " " << c;
        };
        const glm::dvec3 drawnPlace(place.x, place.y, place.z * exaggeration);
        const glm::dvec3 fromEye = drawnPlace - scene.camera.eyeLocal;
        for (int c = 0; c < 3; ++c) {
          near(fractions, static_cast<size_t>(c), (place - origin)[c] / 6000.0 + 0.5);
          near(eyes, static_cast<size_t>(c), fromEye[c] / 20000.0 + 0.5);
        }
        near(far, 0, glm::length(fromEye) / 20000.0);
        near(far, 1, glm::dot(fromEye, scene.camera.forward) / 20000.0);
        // The normal of the surface around, within what a pixel covers.
        const auto height = [&](double dx, double dy) {
          return exaggeration * surfaceHeight(scene.world, {place.x + dx, place.y + dy}, 1);
        };
        if (place.x < 60.0 || place.y > -60.0 || place.x > 5000.0 || place.y < -5000.0) continue;
        const double h = 12.0;
        const glm::dvec3 normal = glm::normalize(
            glm::dvec3(height(-h, 0.0) - height(h, 0.0), height(0.0, -h) - height(0.0, h), 2.0 * h));
        for (size_t c = 0; c < 3; ++c)
          if (std::abs(normals[4 * i + c] - 255.0 * (normal[static_cast<int>(c)] * 0.5 + 0.5)) > 40.0) {
            ++offNormals;
            break;
          }
      }
      EXPECT_GT(ground, 20000);
      EXPECT_GT(sky, 250);
      EXPECT_LT(offNormals, ground / 20);
      if (api == gpu::Api::OpenGl && exaggeration == 1.0)
        look("pass_normals", normals, kPassWidth, kPassHeight);
    }
  }
}

TEST(GroundPasses, ContourLinesAreAtTheirHeights) {
  const Scene scene;
  const auto bare = scene.draw();
  ASSERT_TRUE(scene.renderer().setPass("contours", kContours, {}).ok());
  ASSERT_TRUE(scene.renderer().setPassUniform("contours", "interval", std::array<float, 1>{100.0F}).ok());
  ASSERT_TRUE(
      scene.renderer().setPassUniform("contours", "ink", std::array<float, 3>{0.2F, 0.0F, 0.0F}).ok());
  const auto lined = scene.draw();
  look("pass_contours", lined, kPassWidth, kPassHeight);
  const auto places = scene.renderer().drawPositions(scene.cut, scene.world.frame, scene.camera);
  ASSERT_TRUE(places.ok());
  int onLine = 0;
  for (int y = 1; y + 1 < kPassHeight; ++y)
    for (int x = 1; x + 1 < kPassWidth; ++x) {
      const auto at = [&](int dx, int dy) {
        return (*places)[static_cast<size_t>((y + dy) * kPassWidth + x + dx)].z;
      };
      // Does a contour pass between this pixel and its neighbours?
      double low = 1e9, high = -1e9;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) low = std::min(low, at(dx, dy)), high = std::max(high, at(dx, dy));
      const auto i = static_cast<size_t>(4 * (y * kPassWidth + x));
      const bool isDark = bare[i + 1] - lined[i + 1] > 40;
      if (isDark) {
        ++onLine;
        // Two pixels are told one derivative: contours reach one pixel farther at most.
        EXPECT_TRUE(std::isnan(low + high) || std::floor(low / 100.0 - 0.3) != std::floor(high / 100.0 + 0.3))
            << x << " " << y;
      }
    }
  EXPECT_GT(onLine, 1000);
}

TEST(GroundPasses, RunInTheirOrderAfterLines) {
  const Scene scene;
  ASSERT_TRUE(scene.renderer()
                  .setPass("half", "uniform float by; vec3 apply(Ground g) { return by * g.color; }", {})
                  .ok());
  ASSERT_TRUE(scene.renderer().setPass("white", "vec3 apply(Ground g) { return vec3(1.0); }", {}).ok());
  ASSERT_TRUE(scene.renderer().setPassUniform("half", "by", std::array<float, 1>{0.0F}).ok());
  EXPECT_GT(scene.draw()[1000], 250);
  scene.renderer().removePass("half");
  ASSERT_TRUE(scene.renderer().setPass("half", "vec3 apply(Ground g) { return 0.0 * g.color; }", {}).ok());
  EXPECT_LT(scene.draw()[1000], 5);
  // Replaced in its place.
  ASSERT_TRUE(scene.renderer().setPass("white", "vec3 apply(Ground g) { return vec3(0.5); }", {}).ok());
  EXPECT_LT(scene.draw()[1000], 5);
  scene.renderer().removePass("half");
  scene.renderer().removePass("white");
  GroundLine line;
  line.corners = {{100.0, -2000.0}, {5000.0, -2000.0}};
  line.srgba = {1, 0, 1, 1};
  ASSERT_TRUE(scene.renderer().setLines(std::vector<GroundLine>{line}).ok());
  ASSERT_TRUE(scene.renderer().setPass("swap", "vec3 apply(Ground g) { return g.color.brg; }", {}).ok());
  const auto swapped = scene.draw();
  int yellow = 0;
  for (size_t i = 0; i < swapped.size(); i += 4)
    yellow += swapped[i] > 245 && swapped[i + 1] > 245 && swapped[i + 2] < 20;
  EXPECT_GT(yellow, 100);
}

TEST(GroundPasses, WhatIsWrongIsToldAndThePictureStays) {
  for (const gpu::Api api : {gpu::Api::OpenGl, gpu::Api::OpenGlEs}) {
    const Scene scene(api);
    ASSERT_TRUE(scene.renderer().setPass("good", "vec3 apply(Ground g) { return g.color.bgr; }", {}).ok());
    const auto before = scene.draw();
    const auto refused = [&](const std::string& name, const std::string& text) {
      const Status set = scene.renderer().setPass(name, text, {});
      EXPECT_FALSE(set.ok()) << text;
      EXPECT_EQ(scene.draw(), before);
      return set.ok() ? std::string() : set.error().message;
    };
    // The compiler's words, with the caller's own line.
    const std::string words =
        refused("bad", "uniform float x;\n\nvec3 apply(Ground g) {\n  return oops;\n}\n");
    EXPECT_NE(words.find("oops"), std::string::npos) << words;
    EXPECT_TRUE(words.find("2:4") != std::string::npos || words.find("2(4)") != std::string::npos) << words;
    EXPECT_NE(words.find("2 is bad"), std::string::npos) << words;
    refused("good", "vec3 apply(Ground g) { return 1; }");
    refused("bad", "");
    refused("bad", "}}}}");
    refused("bad", "#version 300 es\nvec3 apply(Ground g) { return g.color; }");
    EXPECT_NE(
        refused("bad", "uniform sampler2D t;\nvec3 apply(Ground g) { return texture(t, g.place.xy).rgb; }")
            .find("uniform t"),
        std::string::npos);
    EXPECT_NE(
        refused("bad", "// discard\n/* discard\n */ vec3 apply(Ground g) {\n  discard;\n}").find("line 4"),
        std::string::npos);
    EXPECT_FALSE(scene.renderer().setPassUniform("bad", "x", std::array<float, 1>{1.0F}).ok());

    // Numbers that are none leave the picture as it was.
    ASSERT_TRUE(scene.renderer()
                    .setPass("good",
                             "uniform float zero;\nuniform vec2 two;\nvec3 apply(Ground g) {\n"
                             "  return zero + two.x > 0.5 ? g.color : sqrt(vec3(-1.0 - g.color)) / zero; }",
                             {})
                    .ok());
    const auto broken = scene.draw();
    scene.renderer().removePass("good");
    EXPECT_LE(worstDifference(broken, scene.draw()), 1);
    ASSERT_TRUE(scene.renderer()
                    .setPass("good", "uniform vec2 two; vec3 apply(Ground g) { return vec3(two, 0.0); }", {})
                    .ok());
    EXPECT_FALSE(scene.renderer().setPassUniform("good", "two", std::array<float, 1>{1.0F}).ok());
    EXPECT_FALSE(scene.renderer().setPassUniform("good", "two", std::array<float, 3>{1.0F, 1.0F, 1.0F}).ok());
    EXPECT_TRUE(scene.renderer().setPassUniform("good", "one", std::array<float, 1>{1.0F}).ok());
    EXPECT_TRUE(scene.renderer().setPassUniform("good", "terraneEye", std::array<float, 4>{}).ok());
    ASSERT_TRUE(scene.renderer().setPassUniform("good", "two", std::array<float, 2>{1.0F, 1.0F}).ok());
    EXPECT_GT(scene.draw()[1001], 250);
  }
}

}  // namespace
}  // namespace terrane
