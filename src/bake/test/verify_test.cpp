#include "terrane/bake/verify.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "function_source.h"
#include "temporary_directory.h"
#include "terrane/bake/build.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/dataset.h"
#include "terrane/dataset/hash.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {
namespace {

namespace fs = std::filesystem;

class VerifyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / (std::string("terrane-verify-") + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    directory_ = (folder_ / "a.terrane").string();
    const auto height = [](int64_t x, int64_t y) {
      return noiseAt(x / 40, y / 40, 1) < 0.2 ? std::numeric_limits<float>::quiet_NaN()
                                              : roughGround(x, y, 1);
    };
    const auto coarse = [](int64_t x, int64_t y) { return roughGround(2 * x, 2 * y, 2); };
    buildFrom(FunctionSource({{1, 0, 0, 300, 250, coarse}, {2, 100, 100, 620, 500, height}}, 0.1, 0.05));
  }
  void buildFrom(const FunctionSource& source, bool inLayers = false) {
    BuildOptions options;
    options.layersBySpacing = inLayers;
    options.output = directory_;
    options.overwrite = true;
    SilentProgress progress;
    const auto report = buildDataset(source, options, progress);
    ASSERT_TRUE(report.ok()) << report.error().message;
  }
  void TearDown() override { fs::remove_all(folder_); }

  Result<VerifyReport> verify() const {
    const VerifyOptions options;
    SilentProgress progress;
    return verifyDataset(directory_, options, progress);
  }
  std::string file(const char* name) const { return directory_ + "/" + name; }

  /// Decodes the dataset, lets `change` spoil a tile, and writes it again with hashes that are right.
  template <class Change>
  void rewrite(TileId which, Change change) {
    auto dataset = Dataset::open(directory_);
    ASSERT_TRUE(dataset.ok());
    Manifest manifest = dataset->manifest();
    std::map<TileId, Tile> tiles;
    std::vector<TileId> order = dataset->elevationTiles();
    std::vector<TileId> topDown = order;
    std::sort(topDown.begin(), topDown.end());
    std::map<TileId, std::vector<uint8_t>> payloads;
    for (const TileId id : topDown) {
      const auto bytes = dataset->readElevation(id);
      const TileSamples* parent = id.isRoot() ? nullptr : &tiles.at(id.parent()).samples;
      const int quadrant = id.isRoot() ? 0 : id.quadrant();
      auto tile = decodeTile(**bytes, parent, quadrant, manifest.scale);
      ASSERT_TRUE(tile.ok());
      if (id == which) change(*tile);
      payloads[id] = encodeTile(*tile, parent, quadrant, manifest.scale);
      tiles.emplace(id, std::move(tile).value());
    }
    fs::remove(file("elevation.pmtiles"));
    auto writer = PmtilesWriter::create(file("elevation.pmtiles"));
    ASSERT_TRUE(writer.ok());
    for (const TileId id : order) ASSERT_TRUE(writer->add(id, payloads.at(id)).ok());
    ASSERT_TRUE(writer->finish("{}").ok());
    manifest.archives[0].bytes = fs::file_size(file("elevation.pmtiles"));
    manifest.archives[0].sha256 = *sha256OfFile(file("elevation.pmtiles"));
    writeWholeFile(file("manifest.json"), manifestToJson(manifest));
  }

  void expectFault(const std::string& words) const {
    const auto report = verify();
    ASSERT_TRUE(report.ok()) << report.error().message;
    ASSERT_GT(report->faultCount, 0U);
    bool found = false;
    for (const std::string& fault : report->faults) found |= fault.find(words) != std::string::npos;
    EXPECT_TRUE(found) << report->faults[0];
  }

  fs::path folder_;
  std::string directory_;
};

TEST_F(VerifyTest, AFreshDatasetIsSound) {
  const auto report = verify();
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->faultCount, 0U) << report->faults[0];
  EXPECT_GT(report->tiles, 5U);
  EXPECT_GT(report->nodes, 2000U);
}

TEST_F(VerifyTest, SeesAnyChangedByteOfTheArchive) {
  const std::string path = file("elevation.pmtiles");
  const std::string good = readWholeFile(path);
  for (size_t at = 0; at < good.size(); at += 1 + good.size() / 40) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x10);
    writeWholeFile(path, bad);
    const auto report = verify();
    ASSERT_TRUE(!report.ok() || report->faultCount > 0) << at;
  }
  for (const size_t size : {size_t{0}, size_t{100}, good.size() / 2, good.size() - 1}) {
    writeWholeFile(path, good.substr(0, size));
    const auto report = verify();
    ASSERT_TRUE(!report.ok() || report->faultCount > 0) << size;
  }
  writeWholeFile(path, good + "x");
  ASSERT_FALSE(verify().ok() && verify()->faultCount == 0);
  fs::remove(path);
  ASSERT_FALSE(verify().ok() && verify()->faultCount == 0);
}

TEST_F(VerifyTest, SeesAnyChangedByteOfTheManifest) {
  const std::string path = file("manifest.json");
  const std::string good = readWholeFile(path);
  for (size_t at = 0; at < good.size(); at += 3) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x01);
    writeWholeFile(path, bad);
    const auto opened = Dataset::open(directory_);
    ASSERT_FALSE(opened.ok()) << at << ": " << bad.substr(at, 20);
  }
  writeWholeFile(path, good.substr(0, good.size() / 2));
  ASSERT_FALSE(verify().ok());
}

TEST_F(VerifyTest, SeesABorderThatDiffers) {
  rewrite({2, 1, 1}, [](Tile& tile) {
    // One new sample of the northern border, a whole metre up.
    for (size_t x = 1; x < kTileSamples; x += 2) {
      if (tile.samples.states[x] != SampleState::Coded) continue;
      const double steps = std::round(static_cast<double>(tile.samples.heights[x]) / 0.1) + 10.0;
      tile.samples.heights[x] = static_cast<float>(steps * 0.1);
      return;
    }
  });
  expectFault("border differ");
}

TEST_F(VerifyTest, SeesACodedSampleWithAnInterpolatedParent) {
  const auto hills = [](int64_t x, int64_t y) { return roughGround(x, y, 1); };
  buildFrom(FunctionSource({{1, 0, 0, 500, 500, hills}}, 12.5, 10.0));
  rewrite({1, 0, 0}, [](Tile& tile) {
    // A quad-centre that is interpolated, and an edge-centre beside it that no longer is.
    for (size_t y = 1; y < kTileSamples; y += 2) {
      for (size_t x = 1; x < kTileSamples - 2; x += 2) {
        const size_t at = y * kTileSamples + x;
        if (tile.samples.states[at] != SampleState::Interpolated) continue;
        tile.samples.states[at + 1] = SampleState::Coded;
        tile.samples.heights[at + 1] = 125.0F;
        return;
      }
    }
  });
  expectFault("an interpolated parent");
}

TEST_F(VerifyTest, SeesAnErrorThatIsTooSmall) {
  rewrite({1, 0, 0}, [](Tile& tile) {
    auto& errors = tile.nodes.error;
    *std::max_element(errors.begin(), errors.end()) = 1;
  });
  expectFault("claims an error");
}

TEST_F(VerifyTest, SeesALostSaturation) {
  rewrite({0, 0, 0}, [](Tile& tile) { tile.nodes.error[0] = tile.nodes.error[1]; });
  expectFault("not strictly saturated");
}

TEST_F(VerifyTest, SeesARangeThatIsTooNarrow) {
  rewrite({2, 1, 0}, [](Tile& tile) {
    for (size_t i = 0; i < tile.nodes.low.size(); ++i) {
      if (tile.nodes.low[i] >= tile.nodes.high[i]) continue;
      tile.nodes.high[i] = tile.nodes.low[i];
      return;
    }
  });
  expectFault("range");
}

TEST_F(VerifyTest, SeesAWrongSummary) {
  rewrite({1, 0, 0}, [](Tile& tile) { tile.children[3].error = 3; });
  expectFault("summary of the child 3");
}

TEST_F(VerifyTest, SeesAWrongRoughness) {
  auto dataset = Dataset::open(directory_);
  ASSERT_TRUE(dataset.ok());
  Manifest manifest = dataset->manifest();
  manifest.scale.roughness *= 1.01;
  writeWholeFile(file("manifest.json"), manifestToJson(manifest));
  expectFault("roughness");
}

TEST_F(VerifyTest, SeesAWrongShareOfZeros) {
  auto dataset = Dataset::open(directory_);
  ASSERT_TRUE(dataset.ok());
  Manifest manifest = dataset->manifest();
  ASSERT_TRUE(manifest.zeroShare);
  manifest.zeroShare = *manifest.zeroShare + 0.01;
  writeWholeFile(file("manifest.json"), manifestToJson(manifest));
  expectFault("stands at 0");
}

TEST_F(VerifyTest, SeesALayerThatIsOff) {
  const auto hills = [](int64_t x, int64_t y) { return roughGround(x, y, 1); };
  buildFrom(FunctionSource({{1, 0, 0, 500, 500, hills}}, 1.5, 1.0), true);
  const auto sound = verify();
  ASSERT_TRUE(sound.ok()) << sound.error().message;
  ASSERT_EQ(sound->faultCount, 0U) << sound->faults[0];
  auto dataset = Dataset::open(directory_);
  ASSERT_TRUE(dataset.ok());
  Manifest manifest = dataset->manifest();
  ASSERT_EQ(manifest.scale.layerCount, 3);
  manifest.scale.layerErrors[0] = 6.0;
  writeWholeFile(file("manifest.json"), manifestToJson(manifest));
  expectFault("with the layers up to 0, a sample is off by");
}

TEST_F(VerifyTest, SeesALayerWithAChangedByte) {
  const auto hills = [](int64_t x, int64_t y) { return roughGround(x, y, 1); };
  buildFrom(FunctionSource({{1, 0, 0, 500, 500, hills}}, 1.5, 1.0), true);
  std::string bytes = readWholeFile(file("elevation-2.pmtiles"));
  bytes[16384 + 40] = static_cast<char>(bytes[16384 + 40] ^ 1);
  writeWholeFile(file("elevation-2.pmtiles"), bytes);
  expectFault("layer 2: ");
}

TEST_F(VerifyTest, SeesAWrongCoverage) {
  rewrite({2, 1, 1}, [](Tile& tile) {
    ASSERT_EQ(tile.samples.coverage.kind, Coverage::Kind::Partial);
    tile.samples.coverage.bits[100] ^= 0xff;
  });
  expectFault("coverage");
}

}  // namespace
}  // namespace terrane
