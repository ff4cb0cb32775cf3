#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "bound_check.h"
#include "others.h"
#include "source_tiles.h"
#include "stored_pyramid.h"
#include "terrane/bake/build.h"
#include "terrane/bake/source.h"

namespace terrane {
namespace {

/// Rough ground whose integers have at most this range; the ends of the range are taken.
TileContent roughTile(int cols, int rows, int32_t low, int32_t range, double bound) {
  std::mt19937 random(static_cast<uint32_t>(range));
  TileContent tile;
  tile.cols = cols;
  tile.rows = rows;
  tile.boundMeters = bound;
  for (int i = 0; i < cols * rows; ++i) {
    const auto value = low + static_cast<int32_t>(random() % (static_cast<uint32_t>(range) + 1U));
    tile.integers.push_back(i == 0 ? low : i == 1 ? low + range : value);
    tile.heights.push_back(static_cast<float>(tile.integers.back()) * 0.25F);
  }
  return tile;
}

TEST(OtherCodecs, KeepWhatTheyCode) {
  for (const int32_t range : {0, 1, 300, 65535}) {
    for (const int side : {1, 2, 65}) {
      if (side == 1 && range > 0) continue;
      const TileContent tile = roughTile(side, side, -1000, range, 0.5);
      for (auto& codec : makeOtherCodecs()) {
        const auto bytes = codec->encode(tile);
        ASSERT_TRUE(bytes.ok()) << codec->name() << ": " << bytes.error().message;
        const Status decoded = codec->decode(*bytes, side, side);
        ASSERT_TRUE(decoded.ok()) << codec->name() << ": " << decoded.error().message;
        EXPECT_TRUE(codec->holds(tile)) << codec->name() << ", " << side << ", " << range;
      }
    }
  }
}

TEST(OtherCodecs, NoticeAChangedSample) {
  TileContent tile = roughTile(40, 30, 5, 1000, 0.1);
  for (auto& codec : makeOtherCodecs()) {
    const auto bytes = codec->encode(tile);
    ASSERT_TRUE(bytes.ok());
    ASSERT_TRUE(codec->decode(*bytes, 40, 30).ok());
    TileContent other = tile;
    other.integers[777] += 1;
    other.heights[777] += 0.25F;
    EXPECT_FALSE(codec->holds(other)) << codec->name();
  }
}

TEST(OtherCodecs, AreGivenQuartersWhereTheRangeIsTooLarge) {
  const std::vector<TileContent> tiles = {roughTile(65, 65, 0, 70000, 0.0)};
  nlohmann::json cache = nlohmann::json::object();
  const auto sizes = measureSizes(tiles, cache);
  ASSERT_TRUE(sizes.ok()) << sizes.error().message;
  EXPECT_EQ(sizes->dividedTiles, 1);
  for (size_t i = 0; i + 1 < kOtherCodecs; ++i) EXPECT_GT(sizes->bytes[i], 6000U);
  EXPECT_EQ(sizes->bytes.back(), 0U);
  for (auto& codec : makeOtherCodecs()) EXPECT_TRUE(EncodedTiles::encode(std::move(codec), tiles, 3).ok());

  // A second time they come from the cache, for these very tiles only.
  ASSERT_EQ(cache.size(), 1U);
  cache.begin().value()[0] = 12345;
  EXPECT_EQ(measureSizes(tiles, cache)->bytes[0], 12345U);
  std::vector<TileContent> changed = tiles;
  changed[0].integers[9] += 1;
  EXPECT_NE(measureSizes(changed, cache)->bytes[0], 12345U);
}

TEST(ContentOf, FillsVoidsAndRoundsWithinTheBound) {
  SourceTile tile;
  tile.heights.assign(kTileSampleCount, std::nanf(""));
  tile.heights[2] = 7.3F;
  tile.heights[5] = -4.9F;
  ElevationScale scale;
  scale.heightStep = 0.1;
  const TileContent lossless = contentOf(tile, scale, 0.0);
  EXPECT_EQ(std::vector<int32_t>(lossless.integers.begin(), lossless.integers.begin() + 7),
            (std::vector<int32_t>{73, 73, 73, 73, 73, -49, -49}));
  const TileContent bounded = contentOf(tile, scale, 2.0);
  for (size_t i = 0; i < bounded.count(); ++i)
    ASSERT_LE(std::abs(bounded.integers[i] * 4.0 - bounded.heights[i]), 2.0);
}

TEST(VoidMasks, AreMadeWhereBothVoidAndGroundAre) {
  SourceTile whole;
  whole.heights.assign(kTileSampleCount, 5.0F);
  SourceTile holed = whole;
  holed.heights[77] = std::nanf("");
  const std::vector<TileContent> masks = voidMasks({whole, holed});
  ASSERT_EQ(masks.size(), 1U);
  EXPECT_EQ(masks[0].integers[77], 0);
  EXPECT_EQ(masks[0].integers[78], 1);
}

/// A small made-up raster and the dataset that a build makes of it.
class StoredPyramidTest : public testing::Test {
 protected:
  StoredPyramidTest() {
    folder_ = std::filesystem::temp_directory_path() / fmt::format("terrane_codec_bench_{}", ::getpid());
    std::filesystem::create_directories(folder_);
    writeRaster();
    SourceOptions source;
    source.inputs = {raster()};
    source.maxErrorMeters = 3.0;
    const auto opened = openSource(source, silent_);
    BuildOptions build;
    build.output = dataset();
    EXPECT_TRUE(opened.ok());
    EXPECT_TRUE(buildDataset(**opened, build, silent_).ok());
  }
  ~StoredPyramidTest() override { std::filesystem::remove_all(folder_); }

  /// Waves of many lengths, with their CRS beside them.
  void writeRaster() const {
    std::ofstream grid(raster());
    grid << "ncols 700\nnrows 513\nxllcenter 500000\nyllcenter 5000000\ncellsize 10\n";
    for (int y = 0; y < 513; ++y) {
      for (int x = 0; x < 700; ++x) {
        double height = 0.5;
        for (double length = 3.0; length < 500.0; length *= 1.7)
          height += 0.1 * length * std::sin(x / length + length) * std::cos(y / length - length);
        grid << static_cast<float>(height) << ' ';
      }
      grid << '\n';
    }
    std::ofstream(folder_ / "a.prj")
        << R"(PROJCS["UTM 32N",GEOGCS["WGS 84",DATUM["WGS_1984",)"
           R"(SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],)"
           R"(UNIT["degree",0.0174532925199433]],)"
           R"(PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],)"
           R"(PARAMETER["central_meridian",9],PARAMETER["scale_factor",0.9996],)"
           R"(PARAMETER["false_easting",500000],PARAMETER["false_northing",0],)"
           R"(UNIT["metre",1]])";
  }

  std::string raster() const { return folder_ / "a.asc"; }
  std::string dataset() const { return folder_ / "a.terrane"; }

  std::filesystem::path folder_;
  SilentProgress silent_;
};

TEST_F(StoredPyramidTest, CountsEverySampleThatBreaksTheBound) {
  const auto pyramid = StoredPyramid::open(dataset());
  ASSERT_TRUE(pyramid.ok()) << pyramid.error().message;
  EXPECT_TRUE(pyramid->decodeAll().ok());
  EXPECT_GT(pyramid->bytes(), pyramid->finestBytes());
  auto source = readSourceTiles(raster(), pyramid->manifest());
  ASSERT_TRUE(source.ok()) << source.error().message;
  int64_t own = 0;
  for (const SourceTile& tile : *source) own += tile.ownSamples;
  EXPECT_EQ(own, 700 * 513);
  EXPECT_EQ(source->size(), 6U);

  const auto sound = checkBound(*pyramid, *source);
  ASSERT_TRUE(sound.ok()) << sound.error().message;
  EXPECT_EQ(sound->violations, 0);
  EXPECT_GE(sound->samples, own);
  EXPECT_LE(sound->largestMeters, 3.0);
  EXPECT_GT(sound->largestMeters, 0.0);

  // Two heights beyond the bound, and one that is void on one side only.
  source->front().heights[1000] += 7.0F;
  source->back().heights[300] -= 7.0F;
  source->back().heights[301] = std::nanf("");
  EXPECT_EQ(checkBound(*pyramid, *source)->violations, 3);
}

}  // namespace
}  // namespace terrane
