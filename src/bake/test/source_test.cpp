#include "terrane/bake/source.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "made_raster.h"

namespace terrane {
namespace {

using test::MadeRaster;
using test::TempFolder;
using test::writeRaster;

// Keeps the warnings.
class ListeningProgress final : public Progress {
 public:
  void beginStage(std::string_view, int64_t, std::string_view) override {}
  void advance(int64_t) override {}
  void warn(const std::string& message) override { warnings.push_back(message); }
  std::vector<std::string> warnings;
};

struct ReadTile {
  bool any = false;
  std::vector<float> heights = std::vector<float>(kTileSampleCount);
  std::vector<uint16_t> ranks = std::vector<uint16_t>(kTileSampleCount);
  float at(int x, int y) const {
    return heights[static_cast<size_t>(y) * kTileSamples + static_cast<size_t>(x)];
  }
  int rankAt(int x, int y) const {
    return ranks[static_cast<size_t>(y) * kTileSamples + static_cast<size_t>(x)];
  }
};

Result<ReadTile> tryRead(const Source& source, TileId id) {
  TERRANE_ASSIGN(auto reader, source.openReader());
  ReadTile tile;
  TERRANE_ASSIGN(tile.any, reader->readTile(id, tile.heights, tile.ranks));
  return tile;
}
ReadTile read(const Source& source, TileId id) {
  auto tile = tryRead(source, id);
  EXPECT_TRUE(tile.ok()) << tile.error().message;
  return tile.ok() ? *tile : ReadTile{};
}

std::unique_ptr<Source> open(SourceOptions options) {
  SilentProgress silent;
  auto source = openSource(options, silent);
  EXPECT_TRUE(source.ok()) << source.error().message;
  return source.ok() ? std::move(source).value() : nullptr;
}

// Options that name the inputs and nothing else.
SourceOptions from(std::vector<std::string> inputs) {
  SourceOptions options;
  options.inputs = std::move(inputs);
  return options;
}

std::string openError(SourceOptions options) {
  SilentProgress silent;
  const auto source = openSource(options, silent);
  return source.ok() ? "no error" : source.error().message;
}

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST(Source, TakesAProjectedRasterSampleBySample) {
  TempFolder folder;
  writeRaster(folder / "a.tif", {.width = 300, .height = 20});
  const auto source = open(from({folder / "a.tif"}));
  ASSERT_TRUE(source);
  const SourcePlan& plan = source->plan();
  EXPECT_EQ(plan.crsName, "WGS 84 / UTM zone 32N");
  EXPECT_EQ(plan.frame.originEasting, 500000.0);
  EXPECT_EQ(plan.frame.originNorthing, 5000000.0);
  EXPECT_EQ(plan.frame.spacingX, 10.0);
  EXPECT_EQ(plan.frame.finestLevel, 1);
  EXPECT_EQ(plan.extentCols, 300);
  EXPECT_EQ(plan.extentRows, 20);
  ASSERT_EQ(plan.inputs.size(), 1u);
  EXPECT_FALSE(plan.inputs[0].warped);
  EXPECT_EQ(plan.inputs[0].name, "a.tif");
  EXPECT_EQ(plan.inputs[0].sha256.size(), 64u);

  // Both tiles share their border; beyond the raster there is nothing.
  const auto west = read(*source, {1, 0, 0});
  const auto east = read(*source, {1, 1, 0});
  EXPECT_TRUE(west.any);
  EXPECT_EQ(west.at(0, 0), 100.0F);
  EXPECT_EQ(west.at(256, 19), 100.0F + 256 + 950);
  EXPECT_EQ(east.at(0, 19), west.at(256, 19));
  EXPECT_EQ(east.at(43, 0), 399.0F);
  EXPECT_TRUE(std::isnan(east.at(44, 0)));
  EXPECT_EQ(east.rankAt(44, 0), 0);
  EXPECT_EQ(east.rankAt(43, 0), 1);
  EXPECT_TRUE(std::isnan(west.at(0, 20)));
  EXPECT_TRUE(source->mayTouch({1, 1, 0}));
  EXPECT_FALSE(source->mayTouch({1, 0, 1}));
  EXPECT_FALSE(read(*source, {1, 0, 1}).any);
}

TEST(Source, RefusesAMissingFile) {
  EXPECT_HAS(openError(from({"/no/such.tif"})), "/no/such.tif: there is no such file");
}

}  // namespace
}  // namespace terrane
