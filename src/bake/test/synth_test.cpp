#include "terrane/bake/synth.h"

#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <unistd.h>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <queue>
#include <random>

#include "input_gdal.h"
#include "synth_cover.h"
#include "synth_ground.h"
#include "synth_world.h"

namespace terrane {
namespace {

namespace fs = std::filesystem;
using synth::Ground;
using synth::GroundTile;
using synth::Water;
using synth::World;

/// One world for all tests: growing it takes seconds.
const World& world() {
  static const std::shared_ptr<const World> grown = synth::shareWorld(1);
  return *grown;
}

GroundTile evaluate(double spacing, int64_t col0, int64_t row0, int cols, int rows) {
  GroundTile tile;
  Ground(world(), spacing).evaluate(col0, row0, cols, rows, tile);
  return tile;
}

/// How much of the land lies more than `meters` below the lowest rim around it: a flood from the edges.
double pitShare(const GroundTile& tile, float meters) {
  struct Entry {
    float level;
    int node;
    bool operator<(const Entry& other) const { return level > other.level; }
  };
  const int count = tile.cols * tile.rows;
  std::vector<float> level(static_cast<size_t>(count), -1.0f);
  std::priority_queue<Entry> queue;
  for (int node = 0; node < count; ++node) {
    const int col = node % tile.cols;
    const int row = node / tile.cols;
    const bool edge = col == 0 || row == 0 || col + 1 == tile.cols || row + 1 == tile.rows;
    if (!edge && tile.water[static_cast<size_t>(node)] != Water::kSea) continue;
    level[static_cast<size_t>(node)] = tile.height[static_cast<size_t>(node)];
    queue.push({tile.height[static_cast<size_t>(node)], node});
  }
  int64_t land = 0;
  int64_t pits = 0;
  while (!queue.empty()) {
    const Entry entry = queue.top();
    queue.pop();
    const size_t at = static_cast<size_t>(entry.node);
    if (tile.water[at] == Water::kNone || tile.water[at] == Water::kRiver) {
      ++land;
      if (entry.level > tile.height[at] + meters) ++pits;
    }
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int col = entry.node % tile.cols + dx;
        const int row = entry.node / tile.cols + dy;
        if (col < 0 || row < 0 || col >= tile.cols || row >= tile.rows) continue;
        const size_t other = static_cast<size_t>(row * tile.cols + col);
        if (level[other] >= 0.0f) continue;
        level[other] = std::max(entry.level, tile.height[other]);
        queue.push({level[other], static_cast<int>(other)});
      }
    }
  }
  return land == 0 ? 0.0 : static_cast<double>(pits) / static_cast<double>(land);
}

TEST(SynthWorld, EveryNodeDrainsToTheSeaWithoutRising) {
  const World& grown = world();
  for (size_t node = 0; node < grown.height.size(); ++node) {
    if (grown.receiver[node] == synth::kNoReceiver) {
      ASSERT_LE(grown.height[node], 0.0f) << "node " << node << " is land without a way out";
      continue;
    }
    const size_t down = synth::downstream(grown, node);
    // Under a lake its water is what counts.
    const float here = grown.inLake[node] ? grown.lakeLevel[node] : grown.height[node];
    const float there = grown.inLake[down] ? grown.lakeLevel[down] : grown.height[down];
    ASSERT_GE(here, there - 0.05f) << "node " << node;
    ASSERT_GT(grown.area[down], grown.area[node]);
  }
}

TEST(SynthGround, ValleysDrain) {
  const GroundTile tile = evaluate(10.0, -512, -512, 1025, 1025);
  const double shallow = pitShare(tile, 0.5f);
  const double deep = pitShare(tile, 5.0f);
  std::printf("land in closed depressions deeper than 0.5 m: %.2f %%, than 5 m: %.2f %%\n", shallow * 100.0,
              deep * 100.0);
  EXPECT_LT(shallow, 0.03);
  EXPECT_LT(deep, 0.005);
}

TEST(SynthGround, HasMountainsPlainsLakesAndAFlatSea) {
  const GroundTile tile = evaluate(80.0, -512, -512, 1025, 1025);
  int64_t sea = 0, lake = 0, high = 0, low = 0;
  for (size_t i = 0; i < tile.height.size(); ++i) {
    sea += tile.water[i] == Water::kSea;
    lake += tile.water[i] == Water::kLake;
    high += tile.height[i] > 1000.0f;
    low += tile.water[i] == Water::kNone && tile.height[i] < 150.0f;
    ASSERT_GE(tile.height[i], 0.0f);
    ASSERT_LT(tile.height[i], 5000.0f);
    ASSERT_GE(tile.depth[i], 0.0f);
    ASSERT_TRUE(tile.water[i] != Water::kSea || tile.height[i] == 0.0f);
  }
  const auto share = [&](int64_t n) {
    return static_cast<double>(n) / static_cast<double>(tile.height.size());
  };
  EXPECT_GT(share(sea), 0.05);
  EXPECT_LT(share(sea), 0.60);
  EXPECT_GT(share(lake), 0.001);
  EXPECT_GT(share(high), 0.02);
  EXPECT_GT(share(low), 0.05);
}

TEST(SynthGround, LakesAreFlat) {
  const GroundTile tile = evaluate(40.0, -1024, -1024, 2048, 2048);
  int64_t pairs = 0;
  for (int row = 0; row < tile.rows; ++row) {
    for (int col = 0; col + 1 < tile.cols; ++col) {
      const size_t i = static_cast<size_t>(row) * static_cast<size_t>(tile.cols) + static_cast<size_t>(col);
      if (tile.water[i] != Water::kLake || tile.water[i + 1] != Water::kLake) continue;
      ++pairs;
      ASSERT_EQ(tile.height[i], tile.height[i + 1]) << col << ' ' << row;
    }
  }
  EXPECT_GT(pairs, 500);
}

TEST(SynthGround, AHeightDependsOnItsPlaceAlone) {
  std::mt19937 random(5);
  for (const double spacing : {2.0, 10.0, 35.0, 250.0}) {
    const GroundTile whole = evaluate(spacing, -200, -150, 400, 300);
    for (int trial = 0; trial < 12; ++trial) {
      const int col0 = static_cast<int>(random() % 350);
      const int row0 = static_cast<int>(random() % 250);
      const int cols = 1 + static_cast<int>(random() % static_cast<unsigned>(400 - col0));
      const int rows = 1 + static_cast<int>(random() % static_cast<unsigned>(300 - row0));
      const GroundTile part = evaluate(spacing, col0 - 200, row0 - 150, cols, rows);
      for (int row = 0; row < rows; ++row) {
        for (int col = 0; col < cols; ++col) {
          const size_t a = static_cast<size_t>((row0 + row) * 400 + col0 + col);
          const size_t b = static_cast<size_t>(row * cols + col);
          ASSERT_EQ(whole.height[a], part.height[b])
              << "spacing " << spacing << " at " << col0 + col << ',' << row0 + row;
          ASSERT_EQ(whole.water[a], part.water[b]);
          ASSERT_EQ(whole.depth[a], part.depth[b]);
        }
      }
    }
  }
}

/// A folder that goes with the test.
class SynthFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("terrane-synth-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override {
    std::error_code code;
    fs::remove_all(folder_, code);
  }
  SynthOptions options(const std::string& name, int64_t cols, int64_t rows) const {
    SynthOptions asked;
    asked.output = (folder_ / name).string();
    asked.cols = cols;
    asked.rows = rows;
    return asked;
  }
  static std::string bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static std::vector<float> read(const std::string& path, int col0, int row0, int cols, int rows) {
    registerGdal();
    const Result<GdalDataset> raster = openRaster(path);
    if (!raster.ok()) return {};
    std::vector<float> values(static_cast<size_t>(cols) * static_cast<size_t>(rows));
    const CPLErr outcome = (*raster)->GetRasterBand(1)->RasterIO(
        GF_Read, col0, row0, cols, rows, values.data(), cols, rows, GDT_Float32, 0, 0, nullptr);
    return outcome == CE_None ? values : std::vector<float>{};
  }
  size_t filesLeft() const { return static_cast<size_t>(std::distance(fs::directory_iterator(folder_), {})); }

  fs::path folder_;
  SilentProgress progress_;
};

TEST_F(SynthFile, SizesAndThreadsGiveTheSameGround) {
  world();
  SynthOptions large = options("large.tif", 1200, 700);
  large.colorOutput = (folder_ / "color.tif").string();
  large.threads = 1;
  const Result<SynthReport> made = synthesize(large, progress_);
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_EQ(made->bytes, fs::file_size(large.output));
  EXPECT_EQ(made->colorBytes, fs::file_size(large.colorOutput));
  EXPECT_EQ(filesLeft(), 2u);

  // More threads: the same bytes.
  SynthOptions threaded = large;
  threaded.output = (folder_ / "threaded.tif").string();
  threaded.colorOutput = (folder_ / "threaded_color.tif").string();
  threaded.threads = 4;
  ASSERT_TRUE(synthesize(threaded, progress_).ok());
  EXPECT_TRUE(bytes(large.output) == bytes(threaded.output));
  EXPECT_TRUE(bytes(large.colorOutput) == bytes(threaded.colorOutput));

  // A smaller size: the same heights around the same middle, though its blocks lie elsewhere.
  const SynthOptions small = options("small.tif", 333, 201);
  ASSERT_TRUE(synthesize(small, progress_).ok());
  EXPECT_EQ(read(small.output, 0, 0, 333, 201), read(large.output, 600 - 166, 350 - 100, 333, 201));
  EXPECT_FALSE(read(small.output, 0, 0, 333, 201).empty());

  // Replaced when asked to.
  SynthOptions again = small;
  again.overwrite = true;
  EXPECT_TRUE(synthesize(again, progress_).ok());
  EXPECT_EQ(filesLeft(), 5u);

  // And at the same place on the map.
  const Result<GdalDataset> raster = openRaster(small.output);
  ASSERT_TRUE(raster.ok());
  double transform[6] = {};
  ASSERT_EQ((*raster)->GetGeoTransform(transform), CE_None);
  EXPECT_EQ(transform[0] + 166.5 * transform[1], 500000.0);
  EXPECT_EQ(transform[3] + 100.5 * transform[5], 6700000.0);
}

TEST_F(SynthFile, BlockBordersDoNotShow) {
  world();
  const SynthOptions asked = options("seams.tif", 1100, 600);
  ASSERT_TRUE(synthesize(asked, progress_).ok());
  const std::vector<float> heights = read(asked.output, 0, 0, 1100, 600);
  ASSERT_EQ(heights.size(), 1100u * 600u);
  // The mean second difference across a column, at the border of two blocks and elsewhere.
  const auto bend = [&](int col) {
    double sum = 0.0;
    for (size_t row = 0; row < 600; ++row) {
      const size_t i = row * 1100 + static_cast<size_t>(col);
      sum += std::fabs(static_cast<double>(heights[i - 1] - 2.0f * heights[i] + heights[i + 1]));
    }
    return sum / 600.0;
  };
  double around = 0.0;
  for (int col = 500; col < 510; ++col) around += bend(col) / 20.0;
  for (int col = 514; col < 524; ++col) around += bend(col) / 20.0;
  EXPECT_LT(bend(511), 1.6 * around);
  EXPECT_LT(bend(512), 1.6 * around);
}

TEST_F(SynthFile, WholeMetresAreTheRoundedHeights) {
  world();
  SynthOptions asked = options("whole.tif", 64, 40);
  asked.type = SynthType::kInt16;
  ASSERT_TRUE(synthesize(asked, progress_).ok());
  const std::vector<float> heights = read(asked.output, 0, 0, 64, 40);
  const GroundTile tile = evaluate(asked.spacingMeters, -32, -20, 64, 40);
  ASSERT_EQ(heights.size(), tile.height.size());
  for (size_t i = 0; i < heights.size(); ++i) ASSERT_EQ(heights[i], std::floor(tile.height[i] + 0.5f));
}

TEST_F(SynthFile, BadRequestsSaySoAndLeaveNothing) {
  const auto refused = [&](const SynthOptions& asked, const char* words) {
    const Result<SynthReport> made = synthesize(asked, progress_);
    ASSERT_FALSE(made.ok());
    EXPECT_NE(made.error().message.find(words), std::string::npos) << made.error().message;
  };
  refused(options("a.tif", 1, 100), "out of range");
  refused(options("a.tif", 100, kSynthMaxSide + 1), "out of range");
  SynthOptions spacing = options("a.tif", 10, 10);
  spacing.spacingMeters = std::nan("");
  refused(spacing, "spacing");
  SynthOptions shared = options("a.tif", 10, 10);
  shared.colorOutput = shared.output;
  refused(shared, "share");
  refused(options("missing/a.tif", 10, 10), "does not exist");
  refused(options(".", 10, 10), "folder");
  EXPECT_EQ(filesLeft(), 0u);

  std::ofstream(folder_ / "there.tif") << "precious";
  refused(options("there.tif", 10, 10), "--overwrite");
  SynthOptions second = options("new.tif", 10, 10);
  second.colorOutput = (folder_ / "there.tif").string();
  refused(second, "--overwrite");
  EXPECT_EQ(bytes((folder_ / "there.tif").string()), "precious");
  EXPECT_EQ(filesLeft(), 1u);
  const std::atomic<bool> cancel = true;
  SynthOptions interrupted = options("b.tif", 10, 10);
  interrupted.cancel = &cancel;
  refused(interrupted, "interrupted");
  EXPECT_EQ(filesLeft(), 1u);
}

}  // namespace
}  // namespace terrane
