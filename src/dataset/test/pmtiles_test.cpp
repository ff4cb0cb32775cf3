#include "terrane/dataset/pmtiles.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "pmtiles_format.h"
#include "random_bytes.h"
#include "temporary_directory.h"

namespace terrane {
namespace {

/// Writes tiles by ascending id and closes the archive.
void writeArchive(const std::string& path, const std::map<uint64_t, std::vector<uint8_t>>& tiles) {
  auto writer = PmtilesWriter::create(path);
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  for (const auto& [id, bytes] : tiles) {
    const auto place = writer->add(tileIdFromPmtiles(id), bytes);
    ASSERT_TRUE(place.ok()) << place.error().message;
  }
  const Status status = writer->finish("{\"name\": \"test\"}");
  ASSERT_TRUE(status.ok()) << status.error().message;
}

void expectHolds(const std::string& path, const std::map<uint64_t, std::vector<uint8_t>>& tiles) {
  const auto reader = PmtilesReader::open(path);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_EQ(reader->tileCount(), tiles.size());
  std::vector<TileId> ids;
  for (const auto& [id, bytes] : tiles) {
    ids.push_back(tileIdFromPmtiles(id));
    const auto found = reader->read(ids.back());
    ASSERT_TRUE(found.ok()) << found.error().message;
    ASSERT_TRUE(found->has_value()) << id;
    ASSERT_EQ(**found, bytes) << id;
    if (tiles.count(id + 1) != 0) continue;
    const auto beside = reader->read(tileIdFromPmtiles(id + 1));
    ASSERT_TRUE(beside.ok() && !beside->has_value()) << id;
  }
  EXPECT_TRUE(reader->tiles() == ids);
}

TEST(PmtilesId, AsPublishedInTheSpecification) {
  EXPECT_EQ(pmtilesId({0, 0, 0}), 0U);
  EXPECT_EQ(pmtilesId({1, 0, 0}), 1U);
  EXPECT_EQ(pmtilesId({1, 0, 1}), 2U);
  EXPECT_EQ(pmtilesId({1, 1, 1}), 3U);
  EXPECT_EQ(pmtilesId({1, 1, 0}), 4U);
  EXPECT_EQ(pmtilesId({2, 0, 0}), 5U);
  EXPECT_EQ(pmtilesId({12, 3423, 1763}), 19078479U);
}

TEST(PmtilesId, IsACurveThatVisitsEveryTileOnce) {
  uint64_t expected = 0;
  for (int level = 0; level <= 8; ++level) {
    TileId last{};
    for (uint64_t i = 0; i < uint64_t{1} << (2 * level); ++i, ++expected) {
      const TileId id = tileIdFromPmtiles(expected);
      ASSERT_EQ(id.level, level);
      ASSERT_TRUE(id.valid());
      ASSERT_EQ(pmtilesId(id), expected);
      // One step along the curve is one step to a neighbour.
      if (i > 0) {
        ASSERT_EQ(std::abs(id.col - last.col) + std::abs(id.row - last.row), 1) << toString(id);
      }
      last = id;
    }
  }
  const int32_t end = (1 << kMaxLevel) - 1;
  for (const TileId id : {TileId{kMaxLevel, 0, 0}, TileId{kMaxLevel, end, 0}, TileId{kMaxLevel, end, end},
                          TileId{kMaxLevel, 12345, end - 7}}) {
    EXPECT_EQ(tileIdFromPmtiles(pmtilesId(id)), id);
  }
}

TEST(Pmtiles, ArchivesOfAllSizesComeBack) {
  TemporaryDirectory directory;
  std::mt19937 random(1);
  for (const size_t count : {0, 1, 2, 1000, 4096, 4097, 20000}) {
    std::map<uint64_t, std::vector<uint8_t>> tiles;
    uint64_t id = 0;
    for (size_t i = 0; i < count; ++i) {
      // Often the neighbour, often with the same bytes.
      const bool same = i > 0 && random() % 3 == 0;
      tiles[id] = same ? tiles.rbegin()->second : randomBytes(1 + random() % 40, random);
      id += random() % 2 == 0 ? 1 : 1 + random() % 1000;
    }
    const std::string path = directory.file(fmt::format("{}.pmtiles", count));
    writeArchive(path, tiles);
    expectHolds(path, tiles);
  }
}

TEST(Pmtiles, IdenticalNeighboursAreStoredOnce) {
  TemporaryDirectory directory;
  const std::vector<uint8_t> sea(1000, 7);
  std::map<uint64_t, std::vector<uint8_t>> tiles;
  for (uint64_t id = 5; id < 21; ++id) tiles[id] = sea;
  tiles[21] = {1, 2, 3};
  tiles[22] = sea;
  for (uint64_t id = 100; id < 300; ++id) tiles[id] = sea;
  const std::string path = directory.file("sea.pmtiles");
  writeArchive(path, tiles);
  expectHolds(path, tiles);
  // One for the first run, one after the three bytes, and a run of 200 in pieces of 64.
  EXPECT_LT(std::filesystem::file_size(path), kPmtilesFirstBytes + 7 * sea.size());
}

TEST(Pmtiles, TheSameTilesAreTheSameBytes) {
  TemporaryDirectory directory;
  std::mt19937 random(3);
  std::map<uint64_t, std::vector<uint8_t>> tiles;
  for (uint64_t id = 0; id < 500; ++id) tiles[id * 3] = randomBytes(50, random);
  writeArchive(directory.file("a"), tiles);
  writeArchive(directory.file("b"), tiles);
  EXPECT_TRUE(readWholeFile(directory.file("a")) == readWholeFile(directory.file("b")));
}

TEST(Pmtiles, AnUnfinishedArchiveIsRemovedAndAnExistingOneIsKept) {
  TemporaryDirectory directory;
  const std::string path = directory.file("half.pmtiles");
  {
    auto writer = PmtilesWriter::create(path);
    ASSERT_TRUE(writer.ok());
    ASSERT_TRUE(writer->add({0, 0, 0}, std::vector<uint8_t>{1}).ok());
  }
  EXPECT_FALSE(std::filesystem::exists(path));

  writeWholeFile(path, "mine");
  const auto refused = PmtilesWriter::create(path);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find(path), std::string::npos);
  EXPECT_EQ(readWholeFile(path), "mine");
}

TEST(Pmtiles, AnArchiveGoesOnFromAnyTileAndGetsTheSameBytes) {
  TemporaryDirectory directory;
  std::mt19937 random(4);
  std::map<uint64_t, std::vector<uint8_t>> tiles;
  for (uint64_t id = 0; id < 40; ++id) {
    // Some runs of equal tiles, and gaps.
    if (id % 9 == 8) continue;
    tiles[id] = id % 5 < 2 && tiles.count(id - 1) != 0 ? tiles[id - 1]
                                                       : randomBytes(30 + static_cast<size_t>(id), random);
  }
  writeArchive(directory.file("whole"), tiles);
  const std::string whole = readWholeFile(directory.file("whole"));

  const std::string path = directory.file("part");
  std::vector<PmtilesPlace> places;
  for (const auto& [last, unused] : tiles) {
    // One tile a time, each followed by rubbish that a killed program may have left.
    auto writer = PmtilesWriter::goOn(path, places);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    const auto place = writer->add(tileIdFromPmtiles(last), tiles[last]);
    ASSERT_TRUE(place.ok()) << place.error().message;
    places.push_back(*place);
    std::ofstream(path, std::ios::binary | std::ios::app) << "rubbish";
  }
  for (int again = 0; again < 2; ++again) {
    auto writer = PmtilesWriter::goOn(path, places);
    ASSERT_TRUE(writer.ok());
    ASSERT_TRUE(writer->finish("{\"name\": \"test\"}").ok());
    EXPECT_TRUE(readWholeFile(path) == whole);
  }
  // What is said to be there and is not.
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  EXPECT_FALSE(PmtilesWriter::goOn(path, places).ok());
  places[3].offset += 1;
  EXPECT_FALSE(PmtilesWriter::goOn(path, places).ok());
}

TEST(Pmtiles, EveryTruncatedLengthIsSeenAtOpen) {
  TemporaryDirectory directory;
  std::mt19937 random(5);
  std::map<uint64_t, std::vector<uint8_t>> tiles;
  for (uint64_t id = 0; id < 5000; ++id) tiles[id] = randomBytes(2, random);
  const std::string path = directory.file("whole");
  writeArchive(path, tiles);
  const std::string whole = readWholeFile(path);
  const std::string cutPath = directory.file("cut");
  for (size_t length = 0; length < whole.size();
       length += length < 300 || length + 300 > whole.size() ? 1 : 397) {
    writeWholeFile(cutPath, whole.substr(0, length));
    const auto result = PmtilesReader::open(cutPath);
    ASSERT_FALSE(result.ok()) << length;
    ASSERT_EQ(result.error().message.rfind(cutPath, 0), 0U) << result.error().message;
  }
}

TEST(Pmtiles, ChangedBytesNeverCrash) {
  TemporaryDirectory directory;
  std::mt19937 random(7);
  std::map<uint64_t, std::vector<uint8_t>> tiles;
  for (uint64_t id = 0; id < 5000; ++id) tiles[id] = randomBytes(2, random);
  const std::string path = directory.file("whole");
  writeArchive(path, tiles);
  const std::string whole = readWholeFile(path);
  for (int i = 0; i < 500; ++i) {
    std::string changed = whole;
    const size_t reach = i % 2 == 0 ? 300 : whole.size();
    changed[random() % reach] ^= static_cast<char>(1 + random() % 255);
    writeWholeFile(path, changed);
    const auto reader = PmtilesReader::open(path);
    if (!reader.ok()) continue;
    const std::vector<TileId> ids = reader->tiles();
    for (size_t tile = 0; tile < ids.size(); tile += 701) {
      const TileId id = ids[tile];
      const auto bytes = reader->read(id);
      ASSERT_TRUE(bytes.ok() && bytes->has_value());
    }
  }
}

// ------------------------------------------------------------------------------------- made to be hostile

/// An archive with uncompressed directories, so that a test can put anything into them.
std::string hostileArchive(PmtilesHeader header, const std::vector<PmtilesEntry>& root,
                           const std::vector<uint8_t>& leaves, size_t dataBytes) {
  const std::vector<uint8_t> rootBytes = directoryToBytes(root);
  header.internalCompression = PmtilesCompression::None;
  header.root = {kPmtilesHeaderBytes, rootBytes.size()};
  header.leaves = {header.root.offset + header.root.length, leaves.size()};
  header.metadata = {header.leaves.offset + leaves.size(), 0};
  header.tileData = {header.metadata.offset, dataBytes};
  std::vector<uint8_t> bytes = pmtilesHeaderToBytes(header);
  bytes.insert(bytes.end(), rootBytes.begin(), rootBytes.end());
  bytes.insert(bytes.end(), leaves.begin(), leaves.end());
  bytes.resize(bytes.size() + dataBytes);
  return {bytes.begin(), bytes.end()};
}

std::string openError(const std::string& bytes) {
  TemporaryDirectory directory;
  const std::string path = directory.file("hostile.pmtiles");
  writeWholeFile(path, bytes);
  const auto result = PmtilesReader::open(path);
  return result.ok() ? "no error" : result.error().message;
}

TEST(Pmtiles, HostileDirectoriesAreErrors) {
  const PmtilesHeader one{.addressedTiles = 1, .tileEntries = 1};
  EXPECT_EQ(openError(hostileArchive(one, {{0, 0, 10, 1}}, {}, 10)), "no error");
  EXPECT_NE(openError(hostileArchive(one, {{0, 0, 11, 1}}, {}, 10)).find("out of place"), std::string::npos);
  EXPECT_NE(openError(hostileArchive(one, {{0, UINT64_MAX - 5, 10, 1}}, {}, 10)).find("out of place"),
            std::string::npos);
  EXPECT_NE(openError(hostileArchive(one, {{0, 0, 10, 4000000000}}, {}, 10)).find("repeated"),
            std::string::npos);
  EXPECT_NE(openError(hostileArchive(one, {{uint64_t{1} << 60, 0, 10, 1}}, {}, 10)).find("below level"),
            std::string::npos);
  const PmtilesHeader two{.addressedTiles = 2, .tileEntries = 2};
  EXPECT_NE(openError(hostileArchive(two, {{0, 0, 10, 1}, {1, 5, 5, 1}}, {}, 10)).find("out of place"),
            std::string::npos);
  EXPECT_NE(openError(hostileArchive(two, {{0, 0, 5, 3}, {1, 5, 5, 1}}, {}, 10)).find("out of order"),
            std::string::npos);
  EXPECT_NE(openError(hostileArchive(two, {{0, 0, 10, 1}}, {}, 10)).find("header says"), std::string::npos);
}

TEST(Pmtiles, LeavesThatPointAtThemselvesOrAtNothingAreErrors) {
  const PmtilesHeader one{.addressedTiles = 1, .tileEntries = 1};
  // A leaf whose only entry is itself.
  std::vector<uint8_t> leaf = directoryToBytes(std::vector<PmtilesEntry>{{3, 0, 5, 0}});
  leaf.resize(5);
  const std::string cycle = hostileArchive(one, {{3, 0, 5, 0}}, leaf, 10);
  EXPECT_NE(openError(cycle).find("nested"), std::string::npos) << openError(cycle);
  // Two pointers to one leaf.
  leaf = directoryToBytes(std::vector<PmtilesEntry>{{3, 0, 5, 1}});
  EXPECT_NE(openError(hostileArchive(one, {{3, 0, 5, 0}, {4, 0, 5, 0}}, leaf, 10)).find("out of place"),
            std::string::npos);
  // A leaf that begins elsewhere than its pointer says, an empty one, and none.
  EXPECT_NE(openError(hostileArchive(one, {{2, 0, 5, 0}}, leaf, 10)).find("does not begin"),
            std::string::npos);
  EXPECT_NE(openError(hostileArchive(one, {{2, 0, 1, 0}}, {0}, 10)).find("does not begin"),
            std::string::npos);
  EXPECT_NE(openError(hostileArchive(one, {{2, 0, 9, 0}}, leaf, 10)).find("out of place"), std::string::npos);
}

TEST(Pmtiles, HostileNumbersAreErrors) {
  const auto errorOf = [](std::vector<uint8_t> bytes) {
    const auto result = directoryFromBytes(bytes);
    return result.ok() ? std::string("no error") : result.error().message;
  };
  EXPECT_NE(errorOf({}).find("ends inside"), std::string::npos);
  EXPECT_NE(errorOf({255, 255, 255, 255, 15}).find("claims"), std::string::npos);
  EXPECT_NE(errorOf({1, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 1}).find("endless"),
            std::string::npos);
  EXPECT_NE(errorOf({2, 0, 0, 1, 1, 1, 1, 1, 0}).find("twice"), std::string::npos);
  EXPECT_NE(errorOf({1, 0, 1, 0, 1}).find("without bytes"), std::string::npos);
  EXPECT_NE(errorOf({1, 0, 1, 1, 0}).find("follows another"), std::string::npos);
  EXPECT_NE(errorOf({1, 0, 1, 1, 1, 1}).find("too many"), std::string::npos);
  EXPECT_EQ(errorOf({1, 0, 1, 1, 1}), "no error");
}

TEST(Pmtiles, GzipBombsStopAtTheirLimit) {
  const std::vector<uint8_t> bomb = gzip(std::vector<uint8_t>(10'000'000, 0));
  EXPECT_LT(bomb.size(), 20000U);
  EXPECT_FALSE(gunzip(bomb, 100'000).ok());
  const auto whole = gunzip(bomb, 10'000'000);
  ASSERT_TRUE(whole.ok());
  EXPECT_EQ(whole->size(), 10'000'000U);
  for (size_t length = 0; length < 200; ++length)
    EXPECT_FALSE(gunzip(std::span(bomb).first(length), 1 << 20).ok());
}

}  // namespace
}  // namespace terrane
