#include "terrane/bake/build.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <map>

#include "build_output.h"
#include "function_source.h"
#include "temporary_directory.h"
#include "terrane/bake/verify.h"
#include "terrane/codec/all_layers.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/dataset.h"
#include "terrane/dataset/hash.h"

namespace terrane {
namespace {

namespace fs = std::filesystem;

/// A folder of its own for each test, removed at the end.
class BuildTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / (std::string("terrane-build-") + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  /// Names in the folder.
  std::vector<std::string> contents() const {
    std::vector<std::string> out;
    for (const auto& entry : fs::directory_iterator(folder_)) out.push_back(entry.path().filename().string());
    std::sort(out.begin(), out.end());
    return out;
  }
  Result<BuildReport> build(const Source& source, const std::string& name, int threads = 2,
                            bool overwrite = false) {
    BuildOptions options;
    options.output = path(name);
    options.threads = threads;
    options.overwrite = overwrite;
    SilentProgress progress;
    return buildDataset(source, options, progress);
  }
  void sameWithAnyThreadsAndMemory(const Source& source);

  fs::path folder_;
};

/// All stored tiles of a dataset, decoded.
std::map<TileId, Tile> decodeAll(const std::string& directory) {
  std::map<TileId, Tile> out;
  auto dataset = Dataset::open(directory);
  EXPECT_TRUE(dataset.ok()) << dataset.error().message;
  std::vector<TileId> ids = dataset->elevationTiles();
  std::sort(ids.begin(), ids.end());
  for (const TileId id : ids) {
    auto payloads = dataset->readAllLayers(id);
    EXPECT_TRUE(payloads.ok() && payloads->has_value());
    const TileSamples* parent = id.isRoot() ? nullptr : &out.at(id.parent()).samples;
    auto tile =
        decodeAllLayers(**payloads, parent, id.isRoot() ? 0 : id.quadrant(), dataset->manifest().scale);
    EXPECT_TRUE(tile.ok()) << tile.error().message;
    out.emplace(id, std::move(tile).value());
  }
  return out;
}

FunctionSource islands(uint64_t seed, double heightStep = 0.1, double maxErrorMeters = 0.05) {
  const auto height = [seed](int64_t x, int64_t y) {
    return noiseAt(x / 40, y / 40, seed) < 0.2 || noiseAt(x, y, seed + 1) < 0.01 ? kNone
                                                                                 : roughGround(x, y, seed);
  };
  return FunctionSource({{2, 0, 0, 700, 900, height}}, heightStep, maxErrorMeters);
}

TEST_F(BuildTest, KeepsEverySampleWithinTheStatedError) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const FunctionSource source = islands(seed);
    const auto report = build(source, "a.terrane", 2, seed > 1);
    ASSERT_TRUE(report.ok()) << report.error().message;
    const auto tiles = decodeAll(path("a.terrane"));
    auto reader = source.openReader();
    std::vector<float> heights(kTileSampleCount);
    std::vector<uint16_t> ranks(kTileSampleCount);
    int compared = 0;
    for (const auto& [id, tile] : tiles) {
      if (id.level != 2) continue;
      ASSERT_TRUE((*reader)->readTile(id, heights, ranks).ok());
      for (size_t i = 0; i < heights.size(); ++i) {
        ASSERT_EQ(std::isnan(heights[i]), tile.samples.states[i] == SampleState::Void);
        if (std::isnan(heights[i])) continue;
        ASSERT_NEAR(heights[i], tile.samples.heights[i], 0.0501);
        ++compared;
      }
    }
    EXPECT_GT(compared, 400000);
  }
  EXPECT_EQ(contents(), std::vector<std::string>{"a.terrane"});
}

TEST_F(BuildTest, SharedSamplesAreEqualBitForBitOverTilesAndLevels) {
  const FunctionSource source = islands(5);
  ASSERT_TRUE(build(source, "a.terrane").ok());
  const auto tiles = decodeAll(path("a.terrane"));
  // Every sample by its place on the finest lattice; voids included, whose heights are a function of place
  // too.
  std::map<std::pair<int64_t, int64_t>, float> known;
  for (const auto& [id, tile] : tiles) {
    const int shift = 2 - id.level;
    for (int y = 0; y < kTileSamples; ++y) {
      for (int x = 0; x < kTileSamples; ++x) {
        if (id.level == 2 && x % 256 != 0 && y % 256 != 0) continue;
        const auto place =
            std::pair((int64_t{id.col} * 256 + x) << shift, (int64_t{id.row} * 256 + y) << shift);
        const float height = tile.samples.heights[static_cast<size_t>(y * kTileSamples + x)];
        const auto [at, isNew] = known.emplace(place, height);
        ASSERT_EQ(at->second, height) << toString(id) << " " << x << " " << y;
      }
    }
  }
}

TEST_F(BuildTest, LeavesToInterpolationWhatThatKeepsWithinTheBound) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    constexpr double kBound = 10.0;
    const FunctionSource source = islands(seed, 12.5, kBound);
    const auto report = build(source, "a.terrane", 2, seed > 1);
    ASSERT_TRUE(report.ok()) << report.error().message;
    SilentProgress progress;
    const auto verified = verifyDataset(path("a.terrane"), {}, progress);
    ASSERT_TRUE(verified.ok()) << verified.error().message;
    ASSERT_EQ(verified->faultCount, 0U) << verified->faults[0];

    const auto tiles = decodeAll(path("a.terrane"));
    auto reader = source.openReader();
    std::vector<float> heights(kTileSampleCount);
    std::vector<uint16_t> ranks(kTileSampleCount);
    std::array<int, 3> interpolated{}, coded{};
    std::map<std::pair<int64_t, int64_t>, std::pair<float, SampleState>> known;
    for (const auto& [id, tile] : tiles) {
      const int shift = 2 - id.level;
      if (shift == 0) {
        ASSERT_TRUE((*reader)->readTile(id, heights, ranks).ok());
      }
      for (int y = 0; y < kTileSamples; ++y) {
        for (int x = 0; x < kTileSamples; ++x) {
          const auto i = static_cast<size_t>(y * kTileSamples + x);
          const SampleState state = tile.samples.states[i];
          ++(state == SampleState::Interpolated ? interpolated : coded)[static_cast<size_t>(id.level)];
          // The same height and state in every tile and level.
          const auto place =
              std::pair((int64_t{id.col} * 256 + x) << shift, (int64_t{id.row} * 256 + y) << shift);
          const auto [at, isNew] = known.emplace(place, std::pair(tile.samples.heights[i], state));
          ASSERT_EQ(at->second, std::pair(tile.samples.heights[i], state))
              << toString(id) << " " << x << " " << y;
          if (shift > 0) continue;
          ASSERT_EQ(std::isnan(heights[i]), state == SampleState::Void);
          if (state != SampleState::Void) {
            ASSERT_LE(
                std::abs(static_cast<double>(heights[i]) - static_cast<double>(tile.samples.heights[i])),
                kBound);
          }
        }
      }
    }
    // On the finest level much is left out, and on those above some.
    EXPECT_GT(interpolated[2], coded[2] / 3);
    EXPECT_GT(interpolated[1], 1000);
    EXPECT_GT(interpolated[0], 100);
    EXPECT_GT(coded[2], 100000);
  }
}

TEST_F(BuildTest, LayersTogetherAreTheDatasetWithoutLayers) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const FunctionSource source = islands(seed, 3.0, 2.0);
    BuildOptions options;
    options.output = path("one.terrane");
    options.overwrite = true;
    SilentProgress progress;
    ASSERT_TRUE(buildDataset(source, options, progress).ok());
    options.output = path("layers.terrane");
    options.layerErrors = {40.0, 15.0, 6.0};
    const auto report = buildDataset(source, options, progress);
    ASSERT_TRUE(report.ok()) << report.error().message;
    const auto verified = verifyDataset(path("layers.terrane"), {}, progress);
    ASSERT_TRUE(verified.ok()) << verified.error().message;
    ASSERT_EQ(verified->faultCount, 0U) << verified->faults[0];
    uint64_t bytes = 0;
    for (int layer = 0; layer < 4; ++layer)
      bytes += fs::file_size(path("layers.terrane/" + elevationArchiveName(layer)));
    EXPECT_EQ(report->archiveBytes, bytes);

    const auto whole = decodeAll(path("one.terrane"));
    const auto tiles = decodeAll(path("layers.terrane"));
    ASSERT_EQ(tiles.size(), whole.size());
    std::array<int, 4> coded{};
    std::map<std::pair<int64_t, int64_t>, int> known;
    for (const auto& [id, tile] : tiles) {
      const Tile& other = whole.at(id);
      ASSERT_EQ(tile.samples.layerCount, 4);
      ASSERT_EQ(tile.samples.heights, other.samples.heights) << toString(id);
      ASSERT_EQ(tile.samples.states, other.samples.states) << toString(id);
      ASSERT_EQ(tile.samples.coverage.kind, other.samples.coverage.kind) << toString(id);
      ASSERT_EQ(tile.samples.coverage.bits, other.samples.coverage.bits) << toString(id);
      ASSERT_EQ(tile.nodes.error, other.nodes.error) << toString(id);
      ASSERT_EQ(tile.nodes.largeError, other.nodes.largeError) << toString(id);
      ASSERT_EQ(tile.nodes.low, other.nodes.low) << toString(id);
      ASSERT_EQ(tile.nodes.high, other.nodes.high) << toString(id);
      // The same layer in every tile and level, and the first on the coarse lattice.
      const int shift = 2 - id.level;
      for (int y = 0; y < kTileSamples; ++y) {
        for (int x = 0; x < kTileSamples; ++x) {
          const auto i = static_cast<size_t>(y * kTileSamples + x);
          if (tile.samples.states[i] != SampleState::Coded) continue;
          const auto place =
              std::pair((int64_t{id.col} * 256 + x) << shift, (int64_t{id.row} * 256 + y) << shift);
          const int layer = tile.samples.layerAt(i);
          ASSERT_EQ(known.emplace(place, layer).first->second, layer) << toString(id) << " " << x << " " << y;
          if (place.first % 16 == 0 && place.second % 16 == 0) {
            ASSERT_EQ(layer, 0);
          }
          if (shift == 0) ++coded[static_cast<size_t>(layer)];
        }
      }
    }
    for (const int samples : coded) EXPECT_GT(samples, 1000);
  }
}

TEST_F(BuildTest, TheFirstLayerIsWhatItsBoundNeeds) {
  // On the same step, the samples of the first layer are those that a dataset with its bound codes.
  const FunctionSource source = islands(4, 3.0, 2.0);
  FunctionSource coarser = islands(4, 3.0, 20.0);
  BuildOptions options;
  SilentProgress progress;
  options.output = path("layers.terrane");
  options.layerErrors = {20.0};
  ASSERT_TRUE(buildDataset(source, options, progress).ok());
  options.output = path("coarser.terrane");
  options.layerErrors.clear();
  ASSERT_TRUE(buildDataset(coarser, options, progress).ok());
  const auto tiles = decodeAll(path("layers.terrane"));
  for (const auto& [id, tile] : decodeAll(path("coarser.terrane"))) {
    if (!tiles.contains(id)) continue;
    const TileSamples first = samplesOfLayer(tiles.at(id).samples, 0);
    ASSERT_EQ(first.states, tile.samples.states) << toString(id);
    ASSERT_EQ(first.heights, tile.samples.heights) << toString(id);
  }
}

TEST_F(BuildTest, LayersAreChosenByTheSpacing) {
  const auto layersOf = [&](const FunctionSource& source) {
    BuildOptions options;
    options.output = path("a.terrane");
    options.overwrite = true;
    options.layersBySpacing = true;
    SilentProgress progress;
    EXPECT_TRUE(buildDataset(source, options, progress).ok());
    const auto dataset = Dataset::open(path("a.terrane"));
    EXPECT_TRUE(dataset.ok());
    const ElevationScale& scale = dataset->manifest().scale;
    return std::vector<double>(scale.layerErrors.begin(), scale.layerErrors.begin() + scale.layerCount - 1);
  };
  // The spacing is 10 m.
  EXPECT_EQ(layersOf(islands(1, 1.5, 1.0)), (std::vector<double>{16.0, 4.0}));
  EXPECT_EQ(layersOf(islands(1, 2.5, 2.0)), (std::vector<double>{16.0}));
  EXPECT_EQ(layersOf(islands(1, 11.0, 8.0)), std::vector<double>());
  EXPECT_EQ(layersOf(islands(1, 1.0, 0.0)), std::vector<double>());
}

TEST_F(BuildTest, RefusesLayersThatAreNone) {
  const auto errorOf = [&](const FunctionSource& source, std::vector<double> layers) {
    BuildOptions options;
    options.output = path("a.terrane");
    options.layerErrors = std::move(layers);
    SilentProgress progress;
    const auto report = buildDataset(source, options, progress);
    return report.ok() ? std::string() : report.error().message;
  };
  const std::vector<std::vector<double>> allBad = {{3.0, 12.0}, {12.0, 12.0},   {2.0},
                                                   {1.0},       {std::nan("")}, {16.0, 8.0, 4.0, 3.0}};
  for (const std::vector<double>& bad : allBad)
    EXPECT_NE(errorOf(islands(1, 3.0, 2.0), bad).find("--layers"), std::string::npos) << bad[0];
  EXPECT_NE(errorOf(islands(1, 1.0, 0.0), {12.0}).find("--max-error"), std::string::npos);
  EXPECT_TRUE(contents().empty());
}

TEST_F(BuildTest, ABoundLetsSmoothGroundGoWithoutItsFinestTiles) {
  const auto swell = [](int64_t x, int64_t y) {
    return static_cast<float>(100.0 * std::sin(static_cast<double>(x) / 300.0) +
                              50.0 * std::cos(static_cast<double>(y) / 200.0));
  };
  const FunctionSource source({{3, 0, 0, 2048, 2048, swell}}, 2.5, 2.0);
  ASSERT_TRUE(build(source, "a.terrane").ok());
  const auto tiles = decodeAll(path("a.terrane"));
  EXPECT_LT(tiles.size(), 1U + 4U + 16U + 64U);
  for (const auto& [id, tile] : tiles) EXPECT_EQ(tile.samples.coverage.kind, Coverage::Kind::Full);
}

void BuildTest::sameWithAnyThreadsAndMemory(const Source& source) {
  ASSERT_TRUE(build(source, "one.terrane", 1).ok());
  ASSERT_TRUE(build(source, "three.terrane", 3).ok());
  BuildOptions options;
  options.output = path("small.terrane");
  options.memoryBytes = 1;
  SilentProgress progress;
  ASSERT_TRUE(buildDataset(source, options, progress).ok());
  const auto dataset = Dataset::open(path("one.terrane"));
  ASSERT_TRUE(dataset.ok()) << dataset.error().message;
  for (int layer = 0; layer < dataset->manifest().scale.layerCount; ++layer) {
    const std::string name = "/" + elevationArchiveName(layer);
    const std::string bytes = readWholeFile(path("one.terrane" + name));
    EXPECT_GT(bytes.size(), 1000U);
    EXPECT_EQ(bytes, readWholeFile(path("three.terrane" + name)));
    EXPECT_EQ(bytes, readWholeFile(path("small.terrane" + name)));
  }
}

TEST_F(BuildTest, TheArchiveDoesNotDependOnThreadsOrMemory) {
  for (const FunctionSource& source : {islands(7), islands(8, 12.5, 10.0)}) {
    sameWithAnyThreadsAndMemory(source);
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
}

TEST_F(BuildTest, FlatSeaCostsNothing) {
  const auto sea = [](int64_t x, int64_t y) { return x < 100 && y < 100 ? roughGround(x, y, 1) : 0.0F; };
  const FunctionSource source({{3, 0, 0, 2048, 2048, sea}}, 0.1, 0.05);
  ASSERT_TRUE(build(source, "a.terrane").ok());
  const auto tiles = decodeAll(path("a.terrane"));
  // On each level the tile with the ground, and the three that touch it.
  EXPECT_EQ(tiles.size(), 1U + 4U + 4U + 4U);
  for (const auto& [id, tile] : tiles) EXPECT_TRUE(id.col <= 1 && id.row <= 1) << toString(id);
  for (const ChildSummary& child : tiles.at({1, 1, 1}).children) {
    EXPECT_EQ(child.state, ChildState::Interpolated);
    EXPECT_LE(child.low, child.high);
  }
  EXPECT_EQ(tiles.at({0, 0, 0}).samples.coverage.kind, Coverage::Kind::Full);
}

TEST_F(BuildTest, VoidCostsNothing) {
  const FunctionSource source(
      {{3, 0, 0, 500, 300, [](int64_t x, int64_t y) { return roughGround(x, y, 2); }}}, 0.1, 0.05);
  ASSERT_TRUE(build(source, "a.terrane").ok());
  const auto tiles = decodeAll(path("a.terrane"));
  // On each level the tiles with ground, and those that touch them.
  EXPECT_EQ(tiles.size(), 1U + 4U + 4U + 9U);
  for (const ChildSummary& child : tiles.at({1, 1, 1}).children) {
    EXPECT_EQ(child.state, ChildState::Void);
    EXPECT_GT(child.low, child.high);
  }
}

TEST_F(BuildTest, CoarseInputsReachUnderFineOnes) {
  // A country at level 1, a village at level 3 on top, a lake of the country on top of that.
  const auto country = [](int64_t x, int64_t y) { return static_cast<float>(500 + (x * 7 + y * 3) % 40); };
  const auto village = [](int64_t x, int64_t y) { return roughGround(x, y, 3); };
  const auto lake = [](int64_t, int64_t) { return 700.0F; };
  const FunctionSource source(
      {{1, 0, 0, 512, 512, country}, {3, 300, 300, 900, 800, village}, {1, 100, 100, 140, 130, lake}}, 0.01,
      0.005);
  ASSERT_TRUE(build(source, "a.terrane").ok());
  const auto tiles = decodeAll(path("a.terrane"));
  for (const auto& [id, tile] : tiles) {
    EXPECT_EQ(tile.samples.coverage.kind, Coverage::Kind::Full) << toString(id);
    if (id.level < 2) continue;
    EXPECT_TRUE(id.col <= 4 && id.row <= 4) << toString(id) << " is where only the coarse input is";
  }
  // note: at level 3 the lake's samples 100..140 become 400..560.
  for (const auto& [id, tile] : tiles) {
    if (id.level != 3) continue;
    for (int y = 0; y < kTileSamples; ++y) {
      for (int x = 0; x < kTileSamples; ++x) {
        const int64_t gx = int64_t{id.col} * 256 + x;
        const int64_t gy = int64_t{id.row} * 256 + y;
        const auto i = static_cast<size_t>(y * kTileSamples + x);
        const bool inLake = gx >= 400 && gx <= 560 && gy >= 400 && gy <= 520;
        const bool inVillage = gx >= 300 && gx <= 900 && gy >= 300 && gy <= 800;
        if (inLake) {
          ASSERT_EQ(tile.samples.heights[i], 700.0F) << gx << " " << gy;
        } else if (inVillage) {
          ASSERT_NEAR(tile.samples.heights[i], village(gx, gy), 0.0052) << gx << " " << gy;
        } else {
          ASSERT_NE(tile.samples.states[i], SampleState::Void);
        }
      }
    }
  }
}

TEST_F(BuildTest, LeavesNothingBehindWhenItFails) {
  const FunctionSource nothing({{1, 0, 0, 300, 300, [](int64_t, int64_t) { return kNone; }}}, 0.1, 0.05);
  const auto report = build(nothing, "a.terrane");
  ASSERT_FALSE(report.ok());
  EXPECT_NE(report.error().message.find("nodata"), std::string::npos) << report.error().message;
  EXPECT_TRUE(contents().empty());

  const FunctionSource tooHigh({{0, 0, 0, 30, 30, [](int64_t, int64_t) { return 3e38F; }}}, 0.1, 0.05);
  ASSERT_FALSE(build(tooHigh, "a.terrane").ok());
  EXPECT_TRUE(contents().empty());

  const std::atomic<bool> cancelled{true};
  BuildOptions options;
  options.output = path("a.terrane");
  options.cancel = &cancelled;
  SilentProgress progress;
  const auto interrupted = buildDataset(islands(1), options, progress);
  ASSERT_FALSE(interrupted.ok());
  EXPECT_NE(interrupted.error().message.find("interrupted"), std::string::npos);
  EXPECT_TRUE(contents().empty());
}

/// A source whose readers give up after some tiles in all.
class BreakingSource final : public Source {
 public:
  BreakingSource(const Source& source, int tiles) : source_(source), left_(tiles) {}
  const SourcePlan& plan() const override { return source_.plan(); }
  std::vector<int> nativeLevels() const override { return source_.nativeLevels(); }
  bool mayTouch(TileId id) const override { return source_.mayTouch(id); }
  Result<std::unique_ptr<SourceReader>> openReader() const override {
    TERRANE_ASSIGN(auto reader, source_.openReader());
    return std::unique_ptr<SourceReader>(new Reader(std::move(reader), left_));
  }

 private:
  class Reader final : public SourceReader {
   public:
    Reader(std::unique_ptr<SourceReader> reader, std::atomic<int>& left)
        : reader_(std::move(reader)), left_(left) {}
    Result<bool> readTile(TileId id, std::span<float> heights, std::span<uint16_t> ranks) override {
      if (left_.fetch_sub(1) <= 0) return makeError("the disk fell off the table");
      return reader_->readTile(id, heights, ranks);
    }

   private:
    std::unique_ptr<SourceReader> reader_;
    std::atomic<int>& left_;
  };
  const Source& source_;
  mutable std::atomic<int> left_;
};

/// Counts warnings.
class WarningCount final : public Progress {
 public:
  void beginStage(std::string_view, int64_t, std::string_view) override {}
  void advance(int64_t) override {}
  void warn(const std::string& message) override {
    ++count;
    last = message;
  }
  int count = 0;
  std::string last;
};

TEST_F(BuildTest, WarnsOfWhatWillNotBeSeenOrStandsForNoData) {
  const auto warningOf = [&](const FunctionSource& source) {
    BuildOptions options;
    options.output = path("w.terrane");
    options.overwrite = true;
    WarningCount progress;
    EXPECT_TRUE(buildDataset(source, options, progress).ok());
    return progress.last;
  };
  const auto hole = [](float height) {
    return [height](int64_t x, int64_t y) { return x < 9 && y < 9 ? height : 100.0F; };
  };
  EXPECT_NE(warningOf(FunctionSource({{0, 0, 0, 40, 40, hole(-9999.0F)}}, 1.0, 0.0)).find("--nodata -9999"),
            std::string::npos);
  EXPECT_NE(warningOf(FunctionSource({{0, 0, 0, 40, 40, hole(32767.0F)}}, 1.0, 0.0)).find("--nodata 32767"),
            std::string::npos);
  EXPECT_EQ(warningOf(FunctionSource({{0, 0, 0, 40, 40, hole(-85.0F)}}, 1.0, 0.0)), "");
  EXPECT_NE(warningOf(FunctionSource({{0, 0, 0, 0, 0, hole(1.0F)}}, 1.0, 0.0)).find("no ground"),
            std::string::npos);
}

TEST_F(BuildTest, GoesOnFromWhatIsDoneAndGetsTheSameBytes) {
  const FunctionSource source = islands(11);
  ASSERT_TRUE(build(source, "whole.terrane").ok());
  for (const int tiles : {1, 5, 11}) {
    const BreakingSource breaking(source, tiles);
    const auto failed = build(breaking, "a.terrane", 2, true);
    ASSERT_FALSE(failed.ok());
    EXPECT_NE(failed.error().message.find("the disk fell off the table"), std::string::npos);
    EXPECT_NE(failed.error().message.find("a.terrane.partial"), std::string::npos) << failed.error().message;
    EXPECT_TRUE(fs::exists(path("a.terrane.partial")));

    const auto report = build(source, "a.terrane", 3, true);
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_EQ(report->stages[0].name, "reading");
    EXPECT_EQ(report->stages[0].jobsResumed, tiles);
    EXPECT_EQ(readWholeFile(path("a.terrane/elevation.pmtiles")),
              readWholeFile(path("whole.terrane/elevation.pmtiles")));
    EXPECT_EQ(readWholeFile(path("a.terrane/elevation-1.pmtiles")),
              readWholeFile(path("whole.terrane/elevation-1.pmtiles")));
    EXPECT_EQ(readWholeFile(path("a.terrane/elevation-2.pmtiles")),
              readWholeFile(path("whole.terrane/elevation-2.pmtiles")));
    EXPECT_EQ(contents(), (std::vector<std::string>{"a.terrane", "whole.terrane"}));
  }
}

TEST_F(BuildTest, WorkForAnotherResultIsOfNoUse) {
  const FunctionSource source = islands(12);
  ASSERT_FALSE(build(BreakingSource(source, 4), "a.terrane").ok());
  ASSERT_TRUE(fs::exists(path("a.terrane.partial")));
  BuildOptions options;
  options.output = path("a.terrane");
  options.attribution = "someone else";
  WarningCount progress;
  const auto report = buildDataset(source, options, progress);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->stages[0].jobsResumed, 0);
  EXPECT_EQ(progress.count, 1);
  EXPECT_NE(progress.last.find("afresh"), std::string::npos) << progress.last;

  // A machine that went down may have lost what was not yet on the disk.
  ASSERT_FALSE(build(BreakingSource(source, 4), "c.terrane").ok());
  std::string plan = readWholeFile(path("c.terrane.partial/plan"));
  ASSERT_TRUE(plan.starts_with("boot "));
  plan[6] = plan[6] == '0' ? '1' : '0';
  std::ofstream(path("c.terrane.partial/plan")) << plan;
  options.output = path("c.terrane");
  options.attribution.clear();
  const auto restarted = buildDataset(source, options, progress);
  ASSERT_TRUE(restarted.ok()) << restarted.error().message;
  EXPECT_EQ(restarted->stages[0].jobsResumed, 0);
  EXPECT_EQ(progress.count, 2);
  EXPECT_NE(progress.last.find("restarted"), std::string::npos) << progress.last;

  // What is no work of a build is not touched.
  fs::create_directories(path("b.terrane.partial"));
  std::ofstream(path("b.terrane.partial/cat.jpg")) << "meow";
  ASSERT_FALSE(build(source, "b.terrane").ok());
  EXPECT_EQ(readWholeFile(path("b.terrane.partial/cat.jpg")), "meow");
}

TEST_F(BuildTest, TwoBuildsOfOneOutputDoNotMeet) {
  const FunctionSource source = islands(13);
  fs::create_directories(path("a.terrane.partial"));
  const int other = open(path("a.terrane.partial").c_str(), O_RDONLY | O_DIRECTORY);
  ASSERT_EQ(flock(other, LOCK_EX | LOCK_NB), 0);
  const auto refused = build(source, "a.terrane");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("another build"), std::string::npos) << refused.error().message;
  close(other);
  ASSERT_TRUE(build(source, "a.terrane").ok());
  EXPECT_EQ(contents(), std::vector<std::string>{"a.terrane"});
}

TEST_F(BuildTest, SaysWhenTheDiskIsTooSmall) {
  SilentProgress progress;
  auto work = WorkFolder::open(path("a.terrane"), false, "a plan\n", progress);
  ASSERT_TRUE(work.ok()) << work.error().message;
  EXPECT_TRUE(checkRoom(*work, 1000).ok());
  const auto missing = [&] {
    const Status status = checkRoom(*work, uint64_t{1} << 60);
    EXPECT_FALSE(status.ok());
    return status.ok() ? std::string() : status.error().message;
  };
  const auto neededIn = [](const std::string& message) {
    return std::stoull(message.substr(message.find('(') + 1));
  };
  const std::string before = missing();
  EXPECT_NE(before.find(folder_.string()), std::string::npos) << before;
  EXPECT_NE(before.find("bytes) are free"), std::string::npos) << before;

  // What was written already needs no room again.
  std::ofstream(work->path() + "/raw.blocks") << std::string(1 << 20, 'x');
  EXPECT_EQ(neededIn(before) - neededIn(missing()), 1U << 20);
}

TEST_F(BuildTest, KilledWhileTidyingUpItIsDoneAllTheSame) {
  const FunctionSource source = islands(14);
  ASSERT_FALSE(build(BreakingSource(source, 4), "a.terrane").ok());
  const std::string plan = readWholeFile(path("a.terrane.partial/plan"));
  ASSERT_TRUE(build(source, "a.terrane").ok());
  const std::string manifest = readWholeFile(path("a.terrane/manifest.json"));

  // As it looks right after the last rename.
  fs::create_directories(path("a.terrane.partial/dataset"));
  std::ofstream(path("a.terrane.partial/plan")) << plan << "committed " << sha256(manifest) << "\n";
  std::ofstream(path("a.terrane.partial/raw.blocks")) << "heights";
  const auto report = build(source, "a.terrane");
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_GT(report->tiles, 0U);
  EXPECT_TRUE(report->stages.empty());
  EXPECT_EQ(readWholeFile(path("a.terrane/manifest.json")), manifest);
  EXPECT_EQ(contents(), std::vector<std::string>{"a.terrane"});

  // For another result, what stands there is in the way.
  fs::create_directories(path("a.terrane.partial/dataset"));
  std::ofstream(path("a.terrane.partial/plan")) << plan << "committed " << sha256(manifest) << "\n";
  BuildOptions options;
  options.output = path("a.terrane");
  options.attribution = "someone else";
  SilentProgress progress;
  const auto other = buildDataset(source, options, progress);
  ASSERT_FALSE(other.ok());
  EXPECT_TRUE(fs::exists(path("a.terrane.partial/plan")));
  EXPECT_NE(other.error().message.find("--overwrite"), std::string::npos) << other.error().message;
  EXPECT_EQ(readWholeFile(path("a.terrane/manifest.json")), manifest);
  fs::remove_all(path("a.terrane.partial"));

  // As it looks right before: everything is done but the rename, to an older dataset's place.
  std::ofstream(path("a.terrane/manifest.json")) << "older";
  fs::create_directories(path("a.terrane.partial/dataset"));
  std::ofstream(path("a.terrane.partial/plan")) << plan << "committed " << sha256(manifest) << "\n";
  EXPECT_FALSE(build(source, "a.terrane").ok());
  ASSERT_TRUE(build(source, "a.terrane", 2, true).ok());
  EXPECT_EQ(readWholeFile(path("a.terrane/manifest.json")), manifest);
  EXPECT_EQ(contents(), std::vector<std::string>{"a.terrane"});
}

TEST_F(BuildTest, ReplacesOnlyDatasetsAndOnlyWhenAsked) {
  const FunctionSource first = islands(1);
  const FunctionSource second = islands(2);
  ASSERT_TRUE(build(first, "a.terrane").ok());
  const std::string before = readWholeFile(path("a.terrane/manifest.json"));
  const auto refused = build(second, "a.terrane");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("--overwrite"), std::string::npos);
  EXPECT_EQ(readWholeFile(path("a.terrane/manifest.json")), before);

  // A build that fails leaves the old one alone.
  const FunctionSource nothing({{1, 0, 0, 300, 300, [](int64_t, int64_t) { return kNone; }}}, 0.1, 0.05);
  ASSERT_FALSE(build(nothing, "a.terrane", 2, true).ok());
  EXPECT_EQ(readWholeFile(path("a.terrane/manifest.json")), before);

  ASSERT_TRUE(build(second, "a.terrane", 2, true).ok());
  EXPECT_NE(readWholeFile(path("a.terrane/manifest.json")), before);
  EXPECT_EQ(contents(), std::vector<std::string>{"a.terrane"});

  fs::create_directories(path("photos"));
  std::ofstream(path("photos/cat.jpg")) << "meow";
  ASSERT_FALSE(build(second, "photos", 2, true).ok());
  EXPECT_EQ(readWholeFile(path("photos/cat.jpg")), "meow");
}

TEST_F(BuildTest, OneSampleIsEnough) {
  const FunctionSource source({{0, 0, 0, 0, 0, [](int64_t, int64_t) { return 12.0F; }}}, 1.0, 0.0);
  ASSERT_TRUE(build(source, "a.terrane").ok());
  const auto tiles = decodeAll(path("a.terrane"));
  ASSERT_EQ(tiles.size(), 1U);
  EXPECT_EQ(tiles.at({0, 0, 0}).samples.coverage.kind, Coverage::Kind::None);
  EXPECT_EQ(tiles.at({0, 0, 0}).samples.heights[0], 12.0F);
}

}  // namespace
}  // namespace terrane
