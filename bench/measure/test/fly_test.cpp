#include "terrane/measure/fly.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

namespace terrane {
namespace {

ReferenceGrid hills() {
  ReferenceGrid grid;
  grid.cols = grid.rows = 129;
  grid.spacingX = grid.spacingY = 10.0;
  for (int64_t j = 0; j < grid.rows; ++j) {
    for (int64_t i = 0; i < grid.cols; ++i) {
      grid.heights.push_back(static_cast<float>(20.0 * std::sin(0.1 * static_cast<double>(i)) *
                                                std::cos(0.1 * static_cast<double>(j))));
    }
  }
  grid.groundCells.assign(static_cast<size_t>(((grid.cols - 1) * (grid.rows - 1) + 7) / 8), 0xff);
  return grid;
}

/// Draws the truth, moved up by `lift`; while less than four tiles are loaded, with a crack.
class MadeUpScene final : public FlightScene {
 public:
  explicit MadeUpScene(const ReferenceSurface& surface) : surface_(surface) {}
  double lift = 0.0;
  bool cracksWhileLoading = false;
  int unloads = 0;

  Status loadAll(const Camera&) override { return {}; }
  Result<FrameCost> drawFrame(const Camera&) override {
    FrameCost cost;
    cost.timeMs = 1.0 + static_cast<double>(frames_++);
    cost.triangles = 1000;
    cost.drawCalls = 2;
    cost.bytes = frames_ == 1 ? 5000 : 0;
    cost.deepestLevel = 3;
    return cost;
  }
  Result<std::vector<glm::dvec3>> places(const Camera& camera) override {
    std::vector<glm::dvec3> places;
    for (int row = 0; row < camera.height; ++row) {
      for (int col = 0; col < camera.width; ++col) {
        const auto hit = surface_.cast(camera.eyeLocal, camera.rayThroughPixel({col + 0.5, row + 0.5}));
        const bool crack = cracksWhileLoading && loaded_.size() < 4 && col == camera.width / 2;
        places.push_back(hit && !crack ? hit->point + glm::dvec3(0, 0, lift)
                                       : glm::dvec3(std::numeric_limits<double>::quiet_NaN()));
      }
    }
    return places;
  }
  Status unload() override {
    loaded_.clear();
    ++unloads;
    return {};
  }
  Result<std::vector<TileId>> wishes(const Camera&) override {
    std::vector<TileId> wanted;
    for (int32_t col = 0; col < 8; ++col) {
      if (loaded_.count(col) == 0) wanted.push_back({3, col, 0});
    }
    return wanted;
  }
  Status load(TileId id) override {
    EXPECT_TRUE(loaded_.insert(id.col).second);
    return {};
  }

 private:
  const ReferenceSurface& surface_;
  int frames_ = 0;
  std::set<int32_t> loaded_;
};

FittedFlight straightDown() {
  const auto flight =
      flightFromJson(R"({"terraneFlight": 1, "halfSide": 640, "heightAbove": "highest", "look": "ahead",
    "keys": [{"time": 0, "eye": [0, -200, 400], "pitch": -80}, {"time": 2, "eye": [0, 200, 400], "pitch": -80}]})",
                     "test");
  FlightGround ground;
  ground.southWestLocal = {0, -1280};
  ground.northEastLocal = {1280, 0};
  ground.maxHeight = 20;
  ground.heightAt = [](glm::dvec2) { return 0.0; };
  return *fitFlight(*flight, Frame{}, ground);
}

FlyOptions smallPictures() {
  FlyOptions options;
  options.width = 64;
  options.height = 36;
  options.framesPerSecond = 5.0;
  options.referenceEvery = 5;
  return options;
}

TEST(Fly, StepsEvenly) {
  FlyOptions options = smallPictures();
  EXPECT_EQ(frameTimes(2.0, options).size(), 11U);
  EXPECT_EQ(frameTimes(0.0, options).size(), 1U);
  options.frames = 3;
  EXPECT_EQ(frameTimes(2.0, options), (std::vector<double>{0.0, 1.0, 2.0}));
}

TEST(Fly, ReportsWhatHappened) {
  const ReferenceSurface surface(hills());
  MadeUpScene scene(surface);
  scene.lift = 1.0;
  SilentProgress progress;
  const FlyOptions options = smallPictures();
  const auto report = fly(scene, straightDown(), options, &surface, nullptr, progress);
  ASSERT_TRUE(report.ok());
  const auto json = reportToJson(*report, {"hills.terrane", "down", "patches", "nothing", 17}, options);
  EXPECT_EQ(json["summary"]["frames"], 11);
  EXPECT_EQ(json["frames"].size(), 11U);
  EXPECT_EQ(json["summary"]["time_ms"]["p50"], 6.0);
  EXPECT_EQ(json["summary"]["time_ms"]["p99"], 11.0);
  EXPECT_EQ(json["summary"]["bytes"], 5000);
  EXPECT_EQ(json["summary"]["draw_calls"]["mean"], 2.0);
  EXPECT_TRUE(json["frames"][5].contains("error"));
  EXPECT_FALSE(json["frames"][4].contains("error"));
  // A metre up and down, seen from above, shows at the picture's border and not in its middle.
  EXPECT_GT(json["summary"]["error"]["max_px"].get<double>(), 0.01);
  EXPECT_LT(json["summary"]["error"]["max_px"].get<double>(), 0.1);
  EXPECT_EQ(json["summary"]["resident"]["cracks"], 0);
  EXPECT_NE(reportToText(*report, {}, options).find("max"), std::string::npos);
}

TEST(Fly, FindsCracksAtRandomMomentsOfLoading) {
  const ReferenceSurface surface(hills());
  const ReferenceSurface::Cover cover(surface, 4);
  SilentProgress progress;
  FlyOptions options = smallPictures();
  options.frames = 1;
  options.loadingViews = 3;
  MadeUpScene whole(surface);
  const auto good = fly(whole, straightDown(), options, &surface, &cover, progress);
  EXPECT_EQ(good->loading.cracks, 0);
  EXPECT_GT(good->loading.checked, 1000);
  EXPECT_GE(good->loadingPictures, 10);
  MadeUpScene broken(surface);
  broken.cracksWhileLoading = true;
  EXPECT_GT(fly(broken, straightDown(), options, &surface, &cover, progress)->loading.cracks, 0);
}

TEST(Fly, PlotsWhatItReports) {
  const ReferenceSurface surface(hills());
  MadeUpScene scene(surface);
  SilentProgress progress;
  const FlyOptions options = smallPictures();
  const auto report = fly(scene, straightDown(), options, &surface, nullptr, progress);
  const std::string svg = plotReport(*report, {"<hills> & dales", "down", "patches", "nothing", 17}, options);
  EXPECT_EQ(svg.rfind("<svg", 0), 0U);
  EXPECT_NE(svg.find("&lt;hills&gt; &amp; dales"), std::string::npos);
  EXPECT_NE(svg.find("Largest error"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

}  // namespace
}  // namespace terrane
