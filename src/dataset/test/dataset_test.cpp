#include "terrane/dataset/dataset.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "small_dataset.h"

namespace terrane {
namespace {

TEST_F(DatasetTest, ReadsWhatIsThere) {
  const auto dataset = Dataset::open(directory_.file(""));
  ASSERT_TRUE(dataset.ok()) << dataset.error().message;
  EXPECT_EQ(dataset->manifest().crsName, "WGS 84 / UTM zone 32N");
  EXPECT_EQ(dataset->elevationTiles(), (std::vector<TileId>{{0, 0, 0}, {1, 0, 0}, {1, 1, 1}}));
  EXPECT_EQ(dataset->bytesRead(), 0U);
  EXPECT_EQ(dataset->readElevation({1, 0, 0}).value().value(), (std::vector<uint8_t>{4, 5}));
  EXPECT_FALSE(dataset->readElevation({1, 1, 0}).value().has_value());
  EXPECT_FALSE(dataset->readElevation({9, 1, 0}).value().has_value());
  EXPECT_EQ(dataset->bytesRead(), 2U);
  SilentProgress progress;
  EXPECT_TRUE(checkArchives(*dataset, progress).ok());
}

TEST_F(DatasetTest, SeveralTilesAreReadTogether) {
  const auto dataset = Dataset::open(directory_.file(""));
  ASSERT_TRUE(dataset.ok());
  const std::vector<TileId> wanted = {{1, 1, 1}, {1, 1, 0}, {0, 0, 0}, {1, 1, 1}};
  const auto read = dataset->readElevation(wanted);
  ASSERT_TRUE(read.ok());
  ASSERT_EQ(read->size(), 4U);
  EXPECT_EQ((*read)[0], (std::vector<uint8_t>{6}));
  EXPECT_FALSE((*read)[1].has_value());
  EXPECT_EQ((*read)[2], (std::vector<uint8_t>{1, 2, 3}));
  EXPECT_EQ((*read)[3], (*read)[0]);
  EXPECT_EQ(dataset->bytesRead(), 5U);
  EXPECT_TRUE(dataset->readElevation(std::vector<TileId>{})->empty());
}

TEST_F(DatasetTest, OpenFilesStayWhatTheyWere) {
  const auto dataset = Dataset::open(directory_.file(""));
  ASSERT_TRUE(dataset.ok());
  // As a build puts another in its place: a new file of that name.
  std::filesystem::rename(archive(), archive() + ".old");
  writeWholeFile(archive(), "something else");
  EXPECT_EQ(dataset->readElevation({1, 0, 0}).value().value(), (std::vector<uint8_t>{4, 5}));
}

TEST_F(DatasetTest, AnAddressIsNoDirectory) {
  for (const char* address : {"http://127.0.0.1/d/made", "https:/host/made"}) {
    const auto dataset = Dataset::open(address);
    ASSERT_FALSE(dataset.ok());
    EXPECT_NE(dataset.error().message.find("on disk"), std::string::npos) << dataset.error().message;
  }
}

TEST_F(DatasetTest, EveryChangedByteOfAnArchiveIsSeen) {
  const std::string whole = readWholeFile(archive());
  SilentProgress progress;
  for (size_t i = 0; i < whole.size(); i += i < 300 || i > 16370 ? 1 : 211) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 4);
    writeWholeFile(archive(), changed);
    const auto dataset = Dataset::open(directory_.file(""));
    const Status status = dataset.ok() ? checkArchives(*dataset, progress) : Status(dataset.error());
    ASSERT_FALSE(status.ok()) << i;
    ASSERT_NE(status.error().message.find("elevation.pmtiles"), std::string::npos) << status.error().message;
  }
}

TEST_F(DatasetTest, TruncatedArchivesAreSeenAtOpen) {
  const std::string whole = readWholeFile(archive());
  for (const size_t length : {size_t{0}, size_t{100}, whole.size() - 1}) {
    writeWholeFile(archive(), whole.substr(0, length));
    EXPECT_NE(openError().find("copy the dataset again"), std::string::npos) << openError();
  }
  writeWholeFile(archive(), whole + "x");
  EXPECT_NE(openError().find("copy the dataset again"), std::string::npos) << openError();
}

TEST_F(DatasetTest, WhatIsMissingIsNamedWithARemedy) {
  const auto nowhere = Dataset::open(directory_.file("nowhere.terrane"));
  ASSERT_FALSE(nowhere.ok());
  EXPECT_NE(nowhere.error().message.find("nowhere.terrane: does not exist"), std::string::npos);
  const auto file = Dataset::open(archive());
  ASSERT_FALSE(file.ok());
  EXPECT_NE(file.error().message.find("is not a dataset directory"), std::string::npos);

  manifest_.tileCount = 4;
  writeManifest();
  EXPECT_NE(openError().find("has 3 tiles, the manifest says 4"), std::string::npos) << openError();
  manifest_.archives.clear();
  writeManifest();
  EXPECT_NE(openError().find("lists no elevation.pmtiles"), std::string::npos) << openError();
  std::filesystem::remove(directory_.file("manifest.json"));
  EXPECT_NE(openError().find("has no manifest.json"), std::string::npos) << openError();
}

TEST_F(DatasetTest, AMissingArchiveIsNamed) {
  std::filesystem::remove(archive());
  EXPECT_NE(openError().find("elevation.pmtiles: cannot open"), std::string::npos) << openError();
}

/// The same with a layer of significance more, whose tiles are these.
class LayeredDatasetTest : public DatasetTest {
 protected:
  void addLayer(const std::vector<TileId>& ids) {
    const std::string path = directory_.file("elevation-1.pmtiles");
    auto writer = PmtilesWriter::create(path);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    for (const TileId id : ids)
      ASSERT_TRUE(writer->add(id, std::vector<uint8_t>{static_cast<uint8_t>(10 + id.level)}).ok());
    ASSERT_TRUE(writer->finish("{}").ok());
    manifest_.scale.layerCount = 2;
    manifest_.scale.layerErrors = {5.0, manifest_.maxErrorMeters};
    const std::string bytes = readWholeFile(path);
    manifest_.archives.push_back({"elevation-1.pmtiles", bytes.size(), sha256(bytes)});
    writeManifest();
  }
};

TEST_F(LayeredDatasetTest, ReadsEveryLayer) {
  addLayer({{0, 0, 0}, {1, 0, 0}, {1, 1, 1}});
  const auto dataset = Dataset::open(directory_.file(""));
  ASSERT_TRUE(dataset.ok()) << dataset.error().message;
  EXPECT_EQ(**dataset->readElevation({1, 0, 0}), (std::vector<uint8_t>{4, 5}));
  EXPECT_EQ(**dataset->readElevation(1, {1, 0, 0}), (std::vector<uint8_t>{11}));
  EXPECT_EQ(**dataset->readAllLayers({1, 0, 0}), (TilePayloads{{4, 5}, {11}}));
  EXPECT_FALSE(dataset->readAllLayers({1, 1, 0})->has_value());
  const std::vector<TileId> ids = {{0, 0, 0}, {1, 0, 1}, {1, 1, 1}};
  const auto several = dataset->readAllLayers(ids);
  ASSERT_TRUE(several.ok()) << several.error().message;
  EXPECT_EQ(*several->at(0), (TilePayloads{{1, 2, 3}, {10}}));
  EXPECT_FALSE(several->at(1).has_value());
  EXPECT_EQ(*several->at(2), (TilePayloads{{6}, {11}}));
  EXPECT_EQ(elevationBytes(dataset->manifest()), manifest_.archives[0].bytes + manifest_.archives[1].bytes);
}

TEST_F(LayeredDatasetTest, LayersMustHaveTheSameTiles) {
  addLayer({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}});
  const auto dataset = Dataset::open(directory_.file(""));
  ASSERT_TRUE(dataset.ok()) << dataset.error().message;
  for (const TileId id : {TileId{1, 1, 0}, TileId{1, 1, 1}}) {
    const auto read = dataset->readAllLayers(id);
    ASSERT_FALSE(read.ok());
    EXPECT_NE(read.error().message.find("elevation-1.pmtiles"), std::string::npos) << read.error().message;
  }
}

TEST_F(LayeredDatasetTest, AMissingLayerIsToldWhenItIsOpened) {
  addLayer({{0, 0, 0}, {1, 0, 0}});
  EXPECT_NE(openError().find("elevation-1.pmtiles"), std::string::npos) << openError();
  manifest_.archives.pop_back();
  writeManifest();
  EXPECT_NE(openError().find("lists no elevation-1.pmtiles"), std::string::npos) << openError();
}

}  // namespace
}  // namespace terrane
