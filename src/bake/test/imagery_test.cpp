#include "terrane/bake/imagery.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <random>

#include "imagery_build.h"
#include "made_picture.h"
#include "terrane/bake/build.h"
#include "terrane/bake/verify.h"
#include "terrane/dataset/dataset.h"

namespace terrane {
namespace {

using test::MadePicture;
using test::MadeRaster;
using test::TempFolder;
using test::writePicture;
using test::writeRaster;

ImageryTile randomTile(std::mt19937& random) {
  ImageryTile tile;
  for (uint8_t& byte : tile.rgba) byte = static_cast<uint8_t>(random());
  for (size_t i = 3; i < tile.rgba.size(); i += 4) {
    const unsigned kind = random() % 4;
    tile.rgba[i] = kind == 0 ? 0 : kind == 1 ? 255 : static_cast<uint8_t>(random());
  }
  return tile;
}

TEST(Imagery, ParentsAreMeansWeightedByAlpha) {
  std::mt19937 random(1);
  const std::array<ImageryTile, 3> tiles = {randomTile(random), randomTile(random), randomTile(random)};
  const std::array<const ImageryTile*, 4> children = {&tiles[0], nullptr, &tiles[1], &tiles[2]};
  const ImageryTile parent = halveImagery(children);
  for (int y = 0; y < kImageryTileSide; ++y) {
    for (int x = 0; x < kImageryTileSide; ++x) {
      const ImageryTile* child = children[static_cast<size_t>(x / 128 + 2 * (y / 128))];
      const uint8_t* texel = &parent.rgba[static_cast<size_t>(4 * (y * kImageryTileSide + x))];
      double alpha = 0.0;
      std::array<double, 3> color{};
      for (int i = 0; i < 4 && child != nullptr; ++i) {
        const int at = (2 * (y % 128) + i / 2) * kImageryTileSide + 2 * (x % 128) + i % 2;
        const uint8_t* from = &child->rgba[static_cast<size_t>(4 * at)];
        alpha += from[3];
        for (size_t c = 0; c < 3; ++c) color[c] += double(from[c]) * from[3];
      }
      ASSERT_EQ(texel[3], static_cast<int>(std::ceil(alpha / 4.0))) << x << " " << y;
      for (size_t c = 0; c < 3 && alpha > 0.0; ++c)
        ASSERT_NEAR(texel[c], color[c] / alpha, 0.51) << x << " " << y;
    }
  }
}

TEST(Imagery, LayingUnderIsWhatAlphaSays) {
  std::mt19937 random(2);
  const ImageryTile over = randomTile(random);
  const ImageryTile under = randomTile(random);
  ImageryTile both = over;
  layUnder(both, under);
  for (size_t i = 0; i < both.rgba.size(); i += 4) {
    const double a = over.rgba[i + 3] / 255.0;
    const double b = (1.0 - a) * under.rgba[i + 3] / 255.0;
    ASSERT_NEAR(both.rgba[i + 3], 255.0 * (a + b), 0.51);
    for (size_t c = 0; c < 3 && a + b > 0.0; ++c)
      ASSERT_NEAR(both.rgba[i + c], (a * over.rgba[i + c] + b * under.rgba[i + c]) / (a + b), 0.51);
  }
}

/// Builds a dataset of a flat 41 x 31 grid, every 10 m, and its imagery; level 0 has texels of 10 m.
class ImageryBuild : public ::testing::Test {
 protected:
  void SetUp() override {
    MadeRaster dem;
    dem.width = 41;
    dem.height = 31;
    writeRaster(folder_ / "dem.tif", dem);
  }

  ImageryLayerOptions layer(std::vector<std::string> names) const {
    ImageryLayerOptions out;
    for (std::string& name : names) out.inputs.push_back(folder_ / name);
    return out;
  }
  Status build(std::vector<ImageryLayerOptions> layers, int threads = 0, uint64_t memory = 0,
               const std::string& output = "made.terrane") {
    SourceOptions source;
    source.inputs = {folder_ / "dem.tif"};
    BuildOptions options;
    options.output = folder_ / output;
    options.overwrite = true;
    options.threads = threads;
    options.memoryBytes = memory;
    options.imagery.layers = std::move(layers);
    options.imagery.quality = 95;
    SilentProgress silent;
    TERRANE_ASSIGN(const auto opened, openSource(source, silent));
    TERRANE_ASSIGN(const BuildReport report, buildDataset(*opened, options, silent));
    TERRANE_ASSIGN(const VerifyReport verified, verifyDataset(options.output, {}, silent));
    EXPECT_EQ(verified.faultCount, 0U) << verified.faults.front();
    EXPECT_EQ(verified.imageryTiles, report.imageryTiles);
    TERRANE_ASSIGN(Dataset dataset, Dataset::open(options.output));
    dataset_.emplace(std::move(dataset));
    return {};
  }
  std::string errorOf(std::vector<ImageryLayerOptions> layers) {
    const Status status = build(std::move(layers));
    return status.ok() ? "no error" : status.error().message;
  }
  /// The texel over a place `x` metres east and `y` south of the first sample, on the layer's finest level.
  std::array<int, 4> at(double x, double y, size_t layer = 0) const {
    const Manifest& manifest = dataset_->manifest();
    const int level = manifest.imagery[layer].finestLevel;
    const double spacing = std::ldexp(10.0, manifest.frame.finestLevel - level);
    const auto col = static_cast<int32_t>(x / spacing);
    const auto row = static_cast<int32_t>(y / spacing);
    const auto bytes = dataset_->readImagery(layer, {level, col / 256, row / 256});
    if (!bytes.ok() || !bytes->has_value()) return {0, 0, 0, 0};
    const auto tile = decodeImagery(**bytes);
    EXPECT_TRUE(tile.ok());
    const auto texel = static_cast<size_t>(4 * (row % 256 * 256 + col % 256));
    return {tile->rgba[texel], tile->rgba[texel + 1], tile->rgba[texel + 2], tile->rgba[texel + 3]};
  }
  static void expectColor(std::array<int, 4> texel, std::array<int, 4> wanted, int tolerance = 4) {
    for (size_t c = 0; c < 4; ++c) EXPECT_NEAR(texel[c], wanted[c], tolerance) << "channel " << c;
  }

  TempFolder folder_;
  std::optional<Dataset> dataset_;
};

/// Four quarters: red, green, blue, white.
double quarters(int band, int col, int row) {
  const int quarter = (col >= 200 ? 1 : 0) + (row >= 150 ? 2 : 0);
  if (quarter == 3) return 250.0;
  return quarter == band - 1 ? 200.0 : 40.0;
}

TEST_F(ImageryBuild, ColoursLieWhereTheyBelong) {
  MadePicture picture;
  picture.valueAt = quarters;
  writePicture(folder_ / "a.tif", picture);
  ASSERT_TRUE(build({layer({"a.tif"})}).ok());
  const ImageryLayerRecord& record = dataset_->manifest().imagery[0];
  // 1 m in 10 m: three levels deeper gives 1.25 m, which is not quite fine enough.
  EXPECT_EQ(record.finestLevel, 4);
  EXPECT_EQ(record.bands, "1,2,3");
  EXPECT_EQ(record.inputs[0].name, "a.tif");
  EXPECT_EQ(record.inputs[0].sha256.size(), 64U);
  EXPECT_NEAR(record.bounds[0], 500000.0, 1e-6);
  EXPECT_NEAR(record.bounds[2], 500400.0, 1e-6);
  EXPECT_NEAR(record.bounds[1], 4999700.0, 1e-6);
  expectColor(at(100, 70), {200, 40, 40, 255});
  expectColor(at(300, 70), {40, 200, 40, 255});
  expectColor(at(100, 220), {40, 40, 200, 255});
  expectColor(at(300, 220), {250, 250, 250, 255});
  // The edge between quarters, to a texel.
  expectColor(at(190, 70), {200, 40, 40, 255}, 12);
  expectColor(at(210, 70), {40, 200, 40, 255}, 12);
}

TEST_F(ImageryBuild, OtherCrsOtherGridsGiveTheSamePlaces) {
  // The same ground in degrees: 1e-5 degrees are about a metre.
  MadePicture picture;
  OGRSpatialReference utm, degrees;
  utm.SetFromUserInput("EPSG:32632");
  degrees.SetFromUserInput("EPSG:4326");
  utm.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  degrees.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> toDegrees(
      OGRCreateCoordinateTransformation(&utm, &degrees));
  const std::unique_ptr<OGRCoordinateTransformation> toUtm(OGRCreateCoordinateTransformation(&degrees, &utm));
  double west = 499950.0, north = 5000050.0;
  ASSERT_TRUE(toDegrees->Transform(1, &west, &north));
  picture.width = 700;
  picture.height = 450;
  picture.crs = "EPSG:4326";
  picture.geoTransform = {west, 0.9e-5, 0.0, north, 0.0, -0.9e-5};
  picture.valueAt = [&](int band, int col, int row) {
    double x = west + (col + 0.5) * 0.9e-5, y = north - (row + 0.5) * 0.9e-5;
    toUtm->Transform(1, &x, &y);
    return quarters(band, static_cast<int>(x - 500000.0), static_cast<int>(5000000.0 - y));
  };
  writePicture(folder_ / "a.tif", picture);
  ASSERT_TRUE(build({layer({"a.tif"})}).ok());
  EXPECT_TRUE(dataset_->manifest().imagery[0].inputs[0].warped);
  expectColor(at(190, 70), {200, 40, 40, 255}, 15);
  expectColor(at(210, 70), {40, 200, 40, 255}, 15);
  expectColor(at(100, 140), {200, 40, 40, 255}, 15);
  expectColor(at(100, 160), {40, 40, 200, 255}, 15);
}

TEST_F(ImageryBuild, LaterFilesLieOnTopAndAlphaLetsThrough) {
  MadePicture below;
  below.valueAt = [](int band, int, int) { return band == 1 ? 200.0 : 20.0; };
  MadePicture above = below;
  above.bands = 4;
  above.alpha = true;
  above.valueAt = [](int band, int col, int) {
    return band == 4 ? (col < 200 ? 255.0 : 0.0) : band == 2 ? 220.0 : 30.0;
  };
  writePicture(folder_ / "below.tif", below);
  writePicture(folder_ / "above.tif", above);
  ASSERT_TRUE(build({layer({"below.tif", "above.tif"})}).ok());
  expectColor(at(100, 100), {30, 220, 30, 255});
  expectColor(at(300, 100), {200, 20, 20, 255});
  ASSERT_TRUE(build({layer({"above.tif", "below.tif"})}).ok());
  expectColor(at(100, 100), {200, 20, 20, 255});
  // Two layers are two archives, in order.
  ImageryLayerOptions first = layer({"below.tif"});
  first.name = "land";
  ImageryLayerOptions second = layer({"above.tif"});
  second.name = "photo";
  ASSERT_TRUE(build({first, second}).ok());
  ASSERT_EQ(dataset_->manifest().imagery.size(), 2U);
  EXPECT_EQ(dataset_->manifest().imagery[1].archive, "imagery-photo.pmtiles");
  expectColor(at(100, 100, 0), {200, 20, 20, 255});
  EXPECT_EQ(at(300, 100, 1)[3], 0);
}

TEST_F(ImageryBuild, SingleBandsOfSixteenBitsAreStretched) {
  for (int band = 1; band <= 3; ++band) {
    MadePicture picture;
    picture.bands = 1;
    picture.type = GDT_UInt16;
    picture.noData = 65535.0;
    // From 8000 to 12000 over the columns, nothing in the last tenth.
    picture.valueAt = [band](int, int col, int row) {
      return row >= 270 ? 65535.0 : 8000.0 + 1000.0 * (band - 1) + 10.0 * col;
    };
    writePicture(folder_ / ("b" + std::to_string(band) + ".tif"), picture);
  }
  ImageryLayerOptions options;
  options.inputs = {(folder_ / "b1.tif") + "+" + (folder_ / "b2.tif") + "+" + (folder_ / "b3.tif")};
  ASSERT_TRUE(build({options}).ok());
  const ImageryLayerRecord& record = dataset_->manifest().imagery[0];
  ASSERT_EQ(record.stretch.size(), 3U);
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(record.stretch[c][0], 8080.0 + 1000.0 * double(c), 30.0);
    EXPECT_NEAR(record.stretch[c][1], 11920.0 + 1000.0 * double(c), 30.0);
  }
  EXPECT_EQ(record.inputs.size(), 3U);
  expectColor(at(200, 100), {127, 127, 127, 255}, 6);
  expectColor(at(3, 100), {0, 0, 0, 255}, 6);
  EXPECT_EQ(at(200, 290)[3], 0);
  // The user's word on the values, and on the bands: the third alone, as grey.
  options.stretch = std::array<double, 2>{10000.0, 20000.0};
  options.bands = {3};
  ASSERT_TRUE(build({options}).ok());
  const int grey = static_cast<int>(255.0 * (2000.0) / 10000.0);
  expectColor(at(200, 100), {grey, grey, grey, 255}, 6);
}

TEST_F(ImageryBuild, PalettesGreysAndNoData) {
  MadePicture palette;
  palette.bands = 1;
  palette.palette = {{0, 0, 0}, {220, 30, 30}, {30, 30, 220}};
  palette.valueAt = [](int, int col, int) { return col < 200 ? 1.0 : 2.0; };
  writePicture(folder_ / "palette.tif", palette);
  ASSERT_TRUE(build({layer({"palette.tif"})}).ok());
  expectColor(at(100, 100), {220, 30, 30, 255});
  expectColor(at(300, 100), {30, 30, 220, 255});

  MadePicture grey;
  grey.bands = 1;
  grey.noData = 0.0;
  grey.valueAt = [](int, int col, int) { return col < 200 ? 0.0 : 90.0; };
  writePicture(folder_ / "grey.tif", grey);
  ASSERT_TRUE(build({layer({"grey.tif"})}).ok());
  EXPECT_EQ(at(100, 100)[3], 0);
  expectColor(at(300, 100), {90, 90, 90, 255});
}

TEST_F(ImageryBuild, ThreadsAndMemoryChangeNoByte) {
  MadePicture picture;
  picture.geoTransform = {500003.3, 0.7, 0.0, 4999998.2, 0.0, -0.7};
  picture.valueAt = [](int band, int col, int row) { return (col * 7 * band + row * 13) % 256; };
  writePicture(folder_ / "a.tif", picture);
  const auto bytesOf = [&](const std::string& name) {
    std::ifstream file((folder_ / name) + "/imagery.pmtiles", std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  ASSERT_TRUE(build({layer({"a.tif"})}, 1, 0, "one.terrane").ok());
  ASSERT_TRUE(build({layer({"a.tif"})}, 4, 400'000, "four.terrane").ok());
  EXPECT_GT(bytesOf("one.terrane").size(), 1000U);
  EXPECT_EQ(bytesOf("one.terrane"), bytesOf("four.terrane"));
}

TEST_F(ImageryBuild, WhatCannotBeTakenIsSaid) {
  MadePicture picture;
  picture.valueAt = quarters;
  writePicture(folder_ / "good.tif", picture);
  picture.geoTransform[0] = 700000.0;
  writePicture(folder_ / "far.tif", picture);
  EXPECT_NE(errorOf({layer({"far.tif"})}).find("does not lie over the elevation"), std::string::npos);
  picture = {};
  picture.crs = "";
  writePicture(folder_ / "nocrs.tif", picture);
  EXPECT_NE(errorOf({layer({"nocrs.tif"})}).find("--imagery-crs"), std::string::npos);
  ImageryLayerOptions given = layer({"nocrs.tif"});
  given.sourceCrs = "EPSG:32632";
  EXPECT_EQ(errorOf({given}), "no error");
  picture = {};
  picture.geoTransform = {0, 0, 0, 0, 0, 0};
  writePicture(folder_ / "noplace.tif", picture);
  EXPECT_NE(errorOf({layer({"noplace.tif"})}).find("does not say where it lies"), std::string::npos);
  ImageryLayerOptions bands = layer({"good.tif"});
  bands.bands = {1, 2, 7};
  EXPECT_NE(errorOf({bands}).find("has no band 7"), std::string::npos);
  EXPECT_NE(errorOf({layer({"good.tif"}), layer({"good.tif"})}).find("named twice"), std::string::npos);
  EXPECT_NE(errorOf({layer({"missing.tif"})}).find("no such file"), std::string::npos);
  picture = {};
  picture.noData = 100.0;
  writePicture(folder_ / "empty.tif", picture);
  EXPECT_NE(errorOf({layer({"empty.tif"})}).find("no texel"), std::string::npos);
  std::filesystem::resize_file(folder_ / "good.tif", 150000);
  EXPECT_NE(errorOf({layer({"good.tif"})}).find("damaged or cut short"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "made.terrane/imagery-x.pmtiles"));
}

/// A beginning of the root is a picture, so it is JPEG; all other tiles have the layer's format.
TEST_F(ImageryBuild, TilesAreWebpAndTheRootIsJpeg) {
  MadePicture picture;
  picture.valueAt = quarters;
  writePicture(folder_ / "a.tif", picture);
  ASSERT_TRUE(build({layer({"a.tif"})}).ok());
  EXPECT_EQ(dataset_->manifest().imagery[0].format, ImageryFormat::Webp);
  const auto ids = dataset_->imageryTiles(0);
  ASSERT_GT(ids.size(), 1U);
  for (const TileId id : ids) {
    const auto bytes = dataset_->readImagery(0, id);
    ASSERT_TRUE(bytes.ok() && bytes->has_value());
    const auto layout = imageryLayout(**bytes);
    ASSERT_TRUE(layout.ok());
    EXPECT_EQ(layout->format, id.level == 0 ? ImageryFormat::Jpeg : ImageryFormat::Webp) << toString(id);
  }
}

TEST_F(ImageryBuild, VerifySeesTilesThatDoNotDecode) {
  MadePicture picture;
  picture.valueAt = quarters;
  writePicture(folder_ / "a.tif", picture);
  ASSERT_TRUE(build({layer({"a.tif"})}).ok());
  const std::string archive = folder_ / "made.terrane/imagery.pmtiles";
  const auto size = std::filesystem::file_size(archive);
  {
    std::fstream file(archive, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(16384 + (size - 16384) / 2));
    const std::string zeros(30, '\xFF');
    file.write(zeros.data(), 30);
  }
  SilentProgress silent;
  const auto report = verifyDataset(folder_ / "made.terrane", {}, silent);
  ASSERT_TRUE(report.ok());
  ASSERT_GE(report->faultCount, 2U);  // the hash, and the tile
  EXPECT_NE(report->faults[1].find("imagery.pmtiles: tile"), std::string::npos) << report->faults[1];
}

}  // namespace
}  // namespace terrane
