#include <gtest/gtest.h>

#include <cmath>

#include "made_picture.h"
#include "terrane/bake/build.h"
#include "terrane/engine/terrain.h"
#include "terrane/engine/terrain_view.h"
#include "terrane/stream/simulated_line.h"

/// From pictures to pictures: what colour a place on the ground has in a picture of it.
namespace terrane {
namespace {

using test::MadePicture;
using test::MadeRaster;
using test::TempFolder;
using test::writePicture;
using test::writeRaster;

constexpr double kMeanHeight = 300.0;
/// Metres from one edge between colours to the next.
constexpr double kPeriod = 50.0;

class ImageryJourney : public ::testing::TestWithParam<bool> {
 protected:
  /// 41 x 31 samples every 10 m, gently rolling, and what lies over them.
  std::unique_ptr<Terrain> open(std::vector<ImageryLayerOptions> layers) {
    MadeRaster dem;
    dem.width = 41;
    dem.height = 31;
    dem.heightAt = [](int col, int row) {
      return kMeanHeight + 4.0 * std::sin(col * 0.4) * std::cos(row * 0.5);
    };
    writeRaster(folder_ / "dem.tif", dem);
    SourceOptions source;
    source.inputs = {folder_ / "dem.tif"};
    BuildOptions options;
    options.output = folder_ / "made.terrane";
    options.imagery.layers = std::move(layers);
    options.imagery.quality = 95;
    SilentProgress silent;
    const auto opened = openSource(source, silent);
    EXPECT_TRUE(opened.ok());
    const auto report = buildDataset(**opened, options, silent);
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    auto terrain = Terrain::open(options.output, {.forceSoftware = true, .openGlEs = GetParam()});
    EXPECT_TRUE(terrain.ok());
    return std::move(terrain).value();
  }

  /// Bands of colour across the ground, `period` metres wide, by metres east and south of the first sample.
  static std::array<int, 3> colorAt(double east, double south, double period) {
    const int a = static_cast<int>(std::floor(east / period)) & 1;
    const int b = static_cast<int>(std::floor(south / period)) & 1;
    return {a != 0 ? 220 : 60, b != 0 ? 210 : 70, a != b ? 200 : 80};
  }
  ImageryLayerOptions layer(const std::string& name, MadePicture picture, double period) {
    const auto transform = picture.geoTransform;
    picture.valueAt = [=](int band, int col, int row) {
      const double east = transform[0] + (col + 0.5) * transform[1] - 500000.0;
      const double south = 5000000.0 - transform[3] - (row + 0.5) * transform[5];
      return static_cast<double>(colorAt(east, south, period)[static_cast<size_t>(band - 1)]);
    };
    writePicture(folder_ / (name + ".tif"), picture);
    ImageryLayerOptions out;
    out.name = name;
    out.inputs = {folder_ / (name + ".tif")};
    return out;
  }
  static RenderStyle bareStyle() {
    RenderStyle style;
    style.haze = false;
    style.imageryRelief = 0.0;
    style.samples = 1;
    return style;
  }

  TempFolder folder_;
};

TEST_P(ImageryJourney, EveryPixelHasTheColourOfItsPlace) {
  const auto terrain = open({layer("photo", {}, kPeriod)});
  int64_t deepest = 0;
  for (const auto& [eye, target] :
       std::vector<std::pair<glm::dvec3, glm::dvec3>>{{{200, -150, 1200}, {200, -149, 300}},
                                                      {{200, -420, 500}, {200, -150, 300}},
                                                      {{60, -40, 340}, {160, -120, 300}}}) {
    const Camera camera = lookAt(eye, target, 0.6, 240, 160);
    const auto cut = terrain->selectAndLoad(camera, {});
    ASSERT_TRUE(cut.ok());
    const auto picture = terrain->draw(*cut, camera, bareStyle());
    ASSERT_TRUE(picture.ok()) << picture.error().message;
    EXPECT_GT(terrain->report().imageryTiles, 0);
    EXPECT_GT(terrain->report().imageryBytes, 0U);
    deepest = std::max(deepest, terrain->report().imageryTiles);
    const auto places = terrain->drawPositions(*cut, camera);
    ASSERT_TRUE(places.ok());
    int seen = 0, wrong = 0;
    for (size_t i = 0; i < places->local.size(); ++i) {
      const glm::dvec3 at = places->local[i];
      if (!(at.x > 5.0 && at.x < 395.0 && at.y < -5.0 && at.y > -295.0)) continue;
      // Edges of the bands are soft: by a pixel, which is long where it lies flat.
      const double distance = glm::length(at - camera.eyeLocal);
      const double steepness = std::max(std::abs(at.z - camera.eyeLocal.z) / distance, 0.1);
      const double margin = 1.0 + 2.5 * distance / camera.pixelsPerTangent() / steepness;
      const auto toEdge = [&](double v) { return std::abs(v - kPeriod * std::round(v / kPeriod)); };
      if (toEdge(at.x) < margin || toEdge(at.y) < margin) continue;
      ++seen;
      const auto wanted = colorAt(at.x, -at.y, kPeriod);
      for (size_t c = 0; c < 3; ++c)
        if (std::abs(picture->rgba[4 * i + c] - wanted[c]) > 12) {
          ++wrong;
          break;
        }
    }
    EXPECT_GT(seen, 500);
    EXPECT_EQ(wrong, 0) << "of " << seen;
  }
  EXPECT_GT(deepest, 4);
}

TEST_P(ImageryJourney, LayersLieInOrderAndMayBeLeftOut) {
  MadePicture whole;
  whole.width = 50;
  whole.height = 40;
  whole.geoTransform = {500000.0, 10.0, 0.0, 5000000.0, 0.0, -10.0};
  MadePicture part;
  part.width = 200;
  part.height = 300;
  const auto terrain = open({layer("land", whole, 1e6), layer("photo", part, 40.0)});
  const Camera camera = lookAt({200, -150, 1000}, {200, -149, 300}, 0.5, 200, 160);
  const auto cut = terrain->selectAndLoad(camera, {});
  ASSERT_TRUE(cut.ok());
  const auto colorOver = [&](glm::dvec3 place) {
    const auto picture = terrain->draw(*cut, camera, bareStyle());
    EXPECT_TRUE(picture.ok());
    const glm::dvec2 pixel = camera.pixelFromLocal(place);
    const auto at =
        static_cast<size_t>(4) * (static_cast<size_t>(pixel.y) * 200 + static_cast<size_t>(pixel.x));
    return std::array<int, 3>{picture->rgba[at], picture->rgba[at + 1], picture->rgba[at + 2]};
  };
  const auto expectNear = [](std::array<int, 3> a, std::array<int, 3> b) {
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 12);
  };
  const glm::dvec3 left{140.0, -140.0, kMeanHeight}, right{300.0, -140.0, kMeanHeight};
  expectNear(colorOver(left), colorAt(140.0, 140.0, 40.0));
  expectNear(colorOver(right), colorAt(300.0, 140.0, 1e6));
  ASSERT_TRUE(terrain->showImagery({"land"}).ok());
  expectNear(colorOver(left), colorAt(140.0, 140.0, 1e6));
  ASSERT_TRUE(terrain->showImagery({"photo"}).ok());
  expectNear(colorOver(left), colorAt(140.0, 140.0, 40.0));
  const auto bare = colorOver(right);
  ASSERT_TRUE(terrain->showImagery({}).ok());
  EXPECT_EQ(colorOver(right), bare);
  EXPECT_EQ(terrain->report().imageryTiles, 0);
  EXPECT_NE(terrain->showImagery({"sea"}).error().message.find("no imagery layer 'sea'"), std::string::npos);
}

/// The same while it streams: whatever is switched, the picture becomes that of the layers that are left.
TEST_P(ImageryJourney, LayersOfAStreamingViewAreSwitchedInFlight) {
  MadePicture whole;
  whole.width = 50;
  whole.height = 40;
  whole.geoTransform = {500000.0, 10.0, 0.0, 5000000.0, 0.0, -10.0};
  MadePicture part;
  part.width = 200;
  part.height = 300;
  open({layer("land", whole, 1e6), layer("photo", part, 40.0)});
  auto context = gpu::Context::createHeadless(
      {.api = GetParam() ? gpu::Api::OpenGlEs : gpu::Api::OpenGl, .forceSoftware = true});
  ASSERT_TRUE(context.ok());
  auto renderer = TerrainRenderer::create(**context);
  ASSERT_TRUE(renderer.ok());
  const auto workers = makeInlineWorkers();
  TerrainView view(std::make_unique<SimulatedLine>(folder_ / "made.terrane", LineModel{}, LineFaults{}),
                   *workers, renderer->get());
  double now = 0.0;
  const Camera camera = lookAt({200, -150, 1000}, {200, -149, 300}, 0.5, 200, 160);
  const auto settle = [&](const Camera& at) {
    do ASSERT_TRUE(view.update(at, now += 1.0 / 60.0).ok());
    while (!view.isSettled() && now < 200.0);
    ASSERT_TRUE(view.isSettled());
  };
  const auto colorOver = [&](glm::dvec3 place) {
    const auto picture = (*renderer)->drawPicture(view.cut(), view.manifest().frame, camera, bareStyle());
    EXPECT_TRUE(picture.ok());
    const glm::dvec2 pixel = camera.pixelFromLocal(place);
    const auto at =
        static_cast<size_t>(4) * (static_cast<size_t>(pixel.y) * 200 + static_cast<size_t>(pixel.x));
    return std::array<int, 3>{picture->rgba[at], picture->rgba[at + 1], picture->rgba[at + 2]};
  };
  const auto expectNear = [](std::array<int, 3> a, std::array<int, 3> b) {
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 12);
  };
  const glm::dvec3 left{140.0, -140.0, kMeanHeight}, right{300.0, -140.0, kMeanHeight};
  // Known or not, before the view is Ready a name is taken.
  EXPECT_TRUE(view.setImageryLayers({"photo", "land"}).ok());
  settle(camera);
  expectNear(colorOver(left), colorAt(140.0, 140.0, 40.0));
  expectNear(colorOver(right), colorAt(300.0, 140.0, 1e6));
  ASSERT_TRUE(view.setImageryLayers({"land"}).ok());
  EXPECT_FALSE(view.isSettled());
  // Nothing flickers meanwhile: the old picture stays until the new one is there.
  expectNear(colorOver(left), colorAt(140.0, 140.0, 40.0));
  settle(camera);
  expectNear(colorOver(left), colorAt(140.0, 140.0, 1e6));
  ASSERT_TRUE(view.setImageryLayers({"photo"}).ok());
  settle(camera);
  expectNear(colorOver(left), colorAt(140.0, 140.0, 40.0));
  const auto bare = colorOver(right);
  ASSERT_TRUE(view.setImageryLayers({}).ok());
  settle(camera);
  EXPECT_EQ(colorOver(right), bare);
  EXPECT_EQ(view.report().imageryOnGpu, 0U);
  EXPECT_FALSE(view.setImageryLayers({"sea"}).ok());
  // Switched while another part of the ground is seen: nothing old comes into sight.
  ASSERT_TRUE(view.setImageryLayers({"land", "photo"}).ok());
  settle(camera);
  ASSERT_TRUE(view.setImageryLayers({"land"}).ok());
  settle(lookAt({200, -150, 1000}, {8000, -4000, 5000}, 0.5, 200, 160));
  settle(camera);
  expectNear(colorOver(left), colorAt(140.0, 140.0, 1e6));
}

INSTANTIATE_TEST_SUITE_P(Dialects, ImageryJourney, ::testing::Bool());

}  // namespace
}  // namespace terrane
