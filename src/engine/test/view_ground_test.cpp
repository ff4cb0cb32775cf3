#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "function_source.h"
#include "temporary_directory.h"
#include "terrane/bake/build.h"
#include "terrane/engine/elevation_query.h"
#include "terrane/engine/read_flight.h"
#include "terrane/engine/surface_profile.h"
#include "terrane/engine/terrain.h"
#include "terrane/stream/simulated_line.h"

/// Questions to a streaming view about the ground that is here.
namespace terrane {
namespace {

class ViewGroundTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory();
    BuildOptions options;
    options.output = folder_->file("made.terrane");
    const auto hills = [](int64_t x, int64_t y) {
      const double u = static_cast<double>(x), v = static_cast<double>(y);
      return static_cast<float>(400.0 * std::sin(u / 91.0) * std::cos(v / 73.0) +
                                60.0 * std::sin(u / 9.0 + v / 7.0));
    };
    const FunctionSource source({{.level = 3, .x0 = 0, .y0 = 0, .x1 = 2048, .y1 = 2048, .height = hills}},
                                0.1, 0.05);
    SilentProgress silent;
    const auto built = buildDataset(source, options, silent);
    ASSERT_TRUE(built.ok()) << built.error().message;
    auto dataset = Dataset::open(options.output);
    ASSERT_TRUE(dataset.ok());
    dataset_ = new Dataset(std::move(dataset).value());
  }
  static void TearDownTestSuite() {
    delete dataset_;
    delete folder_;
  }
  struct Seen {
    std::unique_ptr<Workers> workers = makeInlineWorkers();
    std::unique_ptr<TerrainView> view;
    double now = 0.0;
    explicit Seen(LineModel model = {})
        : view(std::make_unique<TerrainView>(
              std::make_unique<SimulatedLine>(folder_->file("made.terrane"), model, LineFaults{}), *workers,
              nullptr, ViewOptions{})) {}
    void update(const Camera& camera) {
      const auto changed = view->update(camera, now += 1.0 / 60.0);
      ASSERT_TRUE(changed.ok()) << changed.error().message;
    }
    void settle(const Camera& camera) {
      do update(camera);
      while (!view->isSettled() && now < 100.0);
    }
  };
  static Camera camera(double exaggeration = 1.0) {
    return lookAt({4000.0, -9000.0, 900.0 * exaggeration}, {8000.0, -7000.0, 0.0}, 1.0, 640, 360);
  }
  static TemporaryDirectory* folder_;
  static Dataset* dataset_;
};
TemporaryDirectory* ViewGroundTest::folder_ = nullptr;
Dataset* ViewGroundTest::dataset_ = nullptr;

TEST_F(ViewGroundTest, HeightsAreWithinTheirErrorsWhileTilesStillCome) {
  Seen seen({60000.0, 0.05});
  EXPECT_FALSE(seen.view->heightAt({4000.0, -9000.0}));
  EXPECT_FALSE(seen.view->pick(camera(), {320.0, 300.0}));
  ElevationQuery query(*dataset_);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(10.0, 20000.0);
  double first = -1.0, last = 0.0;
  for (int frame = 0; frame < 600; ++frame) {
    seen.update(camera());
    if (frame % 20 != 0) continue;
    double sum = 0.0;
    for (int i = 0; i < 50; ++i) {
      const glm::dvec2 at(place(random), -place(random));
      const auto height = seen.view->heightAt(at);
      const auto error = seen.view->errorAt(at);
      ASSERT_EQ(height.has_value(), error.has_value());
      if (!height) continue;
      const auto exact = query.heightAt(at);
      ASSERT_TRUE(exact.ok() && *exact);
      ASSERT_LE(std::abs(*height - **exact), *error + dataset_->manifest().maxErrorMeters + 1e-6);
      sum += *error;
    }
    if (sum > 0.0 && first < 0.0) first = sum;
    last = sum;
  }
  EXPECT_GT(first, 0.0);
  EXPECT_LT(last, 0.5 * first);
}

TEST_F(ViewGroundTest, APixelIsOnTheGroundThatItShows) {
  for (const double exaggeration : {1.0, 2.5}) {
    Seen seen;
    seen.view->selection().exaggeration = exaggeration;
    const Camera at = camera(exaggeration);
    seen.settle(at);
    ASSERT_TRUE(seen.view->isSettled());
    ElevationQuery query(*dataset_);
    int ground = 0, sky = 0;
    double spent = 0.0;
    for (int y = 5; y < 360; y += 25) {
      for (int x = 5; x < 640; x += 25) {
        const auto begun = std::chrono::steady_clock::now();
        const auto found = seen.view->pick(at, {x + 0.5, y + 0.5});
        spent += std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
        // Steps along the ray, each well below a cell.
        const glm::dvec3 ray = at.rayThroughPixel({x + 0.5, y + 0.5});
        const double until =
            found
                ? glm::dot(glm::dvec3(found->x, found->y, found->z * exaggeration) - at.eyeLocal, at.forward)
                : 14000.0;
        for (double depth = 1.0; depth < until - 1e-3; depth += 3.0) {
          const glm::dvec3 place = at.eyeLocal + depth * ray;
          const auto height = seen.view->heightAt(glm::dvec2(place));
          if (height) {
            ASSERT_GT(place.z, *height * exaggeration - 1e-6) << x << " " << y << " at " << depth;
          }
        }
        if (!found) {
          ++sky;
          continue;
        }
        ++ground;
        const glm::dvec3 drawn(found->x, found->y, found->z * exaggeration);
        ASSERT_LT(glm::length(at.pixelFromLocal(drawn) - glm::dvec2(x + 0.5, y + 0.5)), 1e-6);
        const auto height = seen.view->heightAt(glm::dvec2(*found));
        ASSERT_TRUE(height);
        ASSERT_NEAR(found->z, *height, 1e-5);
      }
    }
    EXPECT_GT(ground, 150);
    EXPECT_GT(sky, 20);
    std::printf("a pick takes %.0f microseconds\n", 1e6 * spent / (ground + sky));
  }
}

/// Far away and behind the camera little is here; what is studied is as the dataset has it, and stays while
/// the camera moves.
TEST_F(ViewGroundTest, StudiedGroundIsAsExactAsTheDataset) {
  Seen seen({4e6, 0.05});
  seen.settle(camera());
  const Frame& frame = seen.view->manifest().frame;
  const std::vector<glm::dvec2> line = {{3000.0, -16000.0}, {700.0, -19000.0}, {9000.0, -18500.0}};
  std::vector<glm::dvec2> samples;
  for (const glm::dvec2 place : line) samples.push_back(frame.sampleFromLocal(place));
  const auto profile = [&] {
    Surface surface = seen.view->surface();
    return profileAlong(surface, frame, samples, 300).value();
  };
  const auto worst = [&] {
    const std::vector<ProfilePoint> points = profile();
    double most = 0.0;
    for (const ProfilePoint& point : points) most = std::max(most, point.errorMeters.value_or(1e9));
    return most;
  };
  const double before = worst();
  EXPECT_GT(before, 5.0);

  seen.view->studyGround({line});
  seen.settle(camera());
  const double exact = dataset_->manifest().maxErrorMeters;
  EXPECT_LE(worst(), exact + 0.1);
  ElevationQuery query(*dataset_);
  const std::vector<ProfilePoint> points = profile();
  for (const ProfilePoint& point : points) {
    const auto expected = query.heightAt(frame.localFromSample(point.sample));
    ASSERT_TRUE(expected.ok() && *expected && point.height);
    ASSERT_NEAR(*point.height, **expected, 1e-6);
  }
  // Seen from elsewhere.
  seen.settle(lookAt({16000.0, -3000.0, 900.0}, {19000.0, -1000.0, 0.0}, 1.0, 640, 360));
  EXPECT_LE(worst(), exact + 0.1);
  seen.view->studyGround({});
  seen.settle(camera());
}

TEST_F(ViewGroundTest, ProfilesAndFlightsUseWhatIsHere) {
  Seen seen;
  seen.settle(camera());
  Surface surface = seen.view->surface();
  const Frame& frame = seen.view->manifest().frame;
  const std::vector<glm::dvec2> corners = {frame.sampleFromLocal({4000.0, -9000.0}),
                                           frame.sampleFromLocal({4600.0, -9000.0}),
                                           frame.sampleFromLocal({4600.0, -8200.0})};
  const auto points = profileAlong(surface, frame, corners, 15);
  ASSERT_TRUE(points.ok());
  ASSERT_EQ(points->size(), 15U);
  EXPECT_NEAR(points->back().distanceMeters, 1400.0, 1e-6);
  for (size_t i = 0; i < points->size(); ++i) {
    const ProfilePoint& point = (*points)[i];
    EXPECT_NEAR(point.distanceMeters, 100.0 * static_cast<double>(i), 1e-6);
    const glm::dvec2 expected = i <= 6 ? glm::dvec2(4000.0 + 100.0 * static_cast<double>(i), -9000.0)
                                       : glm::dvec2(4600.0, -9000.0 + 100.0 * (static_cast<double>(i) - 6.0));
    EXPECT_LT(glm::length(frame.localFromSample(point.sample) - expected), 1e-6);
    ASSERT_TRUE(point.height && point.errorMeters);
    EXPECT_NEAR(*point.height, *seen.view->heightAt(expected), 1e-6);
  }

  const auto wrong = flightOver("{}", "a flight", *seen.view);
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().message.find("a flight"), 0U);
  const std::string text = R"({"terraneFlight": 1, "halfSide": 1000, "look": "ahead", "keys": [
    {"time": 0, "eye": [-200, 0, 50], "pitch": -10}, {"time": 10, "eye": [200, 0, 50], "pitch": -10}]})";
  const auto flight = flightOver(text, "a flight", *seen.view);
  ASSERT_TRUE(flight.ok()) << flight.error().message;
  EXPECT_EQ(flight->durationSeconds(), 10.0);
  const Camera begin = flight->at(0.0, 640, 360);
  const auto under = seen.view->heightAt(glm::dvec2(begin.eyeLocal));
  ASSERT_TRUE(under);
  EXPECT_GT(begin.eyeLocal.z, *under);
}

}  // namespace
}  // namespace terrane
