#include "terrane/dataset/pmtiles_index.h"

#include <gtest/gtest.h>

#include <random>

#include "temporary_directory.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {
namespace {

/// An archive of every `step`-th tile of the first `ids`, each with a few random bytes.
std::vector<uint8_t> makeArchive(const std::string& path, uint64_t ids, uint64_t step) {
  std::mt19937 random(7);
  auto writer = PmtilesWriter::create(path);
  EXPECT_TRUE(writer.ok());
  for (uint64_t id = 0; id < ids; id += step) {
    std::vector<uint8_t> bytes(1 + random() % 9);
    for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random());
    EXPECT_TRUE(writer->add(tileIdFromPmtiles(id), bytes).ok());
  }
  EXPECT_TRUE(writer->finish("{}").ok());
  const std::string archive = readWholeFile(path);
  return {archive.begin(), archive.end()};
}

std::span<const uint8_t> firstOf(const std::vector<uint8_t>& archive) {
  return std::span(archive).first(std::min<size_t>(archive.size(), PmtilesIndex::kFirstBytes));
}

TEST(PmtilesIndex, FindsWhatTheReaderReadsOnceDirectoriesAreThere) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("a.pmtiles");
  for (const uint64_t ids : {uint64_t{90}, uint64_t{40000}}) {
    std::filesystem::remove(path);
    const std::vector<uint8_t> archive = makeArchive(path, ids, 3);
    const auto reader = PmtilesReader::open(path);
    ASSERT_TRUE(reader.ok());
    auto index = PmtilesIndex::open(firstOf(archive), archive.size());
    ASSERT_TRUE(index.ok()) << index.error().message;
    int directories = 0;
    for (uint64_t number = 0; number < ids + 50; ++number) {
      const TileId id = tileIdFromPmtiles(number);
      PmtilesIndex::Found found = index->find(id);
      if (found.kind == PmtilesIndex::Kind::InDirectory) {
        const auto bytes = std::span(archive).subspan(static_cast<size_t>(found.place.offset),
                                                      static_cast<size_t>(found.place.bytes));
        EXPECT_FALSE(index->addDirectory(found.place, bytes.first(bytes.size() / 2)).ok());
        ASSERT_TRUE(index->addDirectory(found.place, bytes).ok());
        ++directories;
        found = index->find(id);
      }
      const auto expected = reader->read(id);
      ASSERT_TRUE(expected.ok());
      ASSERT_EQ(found.kind == PmtilesIndex::Kind::Stored, expected->has_value()) << number;
      if (!expected->has_value()) continue;
      const auto bytes = std::span(archive).subspan(static_cast<size_t>(found.place.offset),
                                                    static_cast<size_t>(found.place.bytes));
      ASSERT_TRUE(std::equal(bytes.begin(), bytes.end(), (*expected)->begin(), (*expected)->end()));
    }
    EXPECT_EQ(directories > 0, ids > 1000);
  }
}

TEST(PmtilesIndex, DamagedBytesAreErrorsOrPlacesWithinTheArchive) {
  const TemporaryDirectory directory;
  const std::vector<uint8_t> archive = makeArchive(directory.file("a.pmtiles"), 300, 2);
  for (size_t length = 0; length < 600; length += 7)
    EXPECT_FALSE(PmtilesIndex::open(std::span(archive).first(length), length).ok()) << length;
  std::mt19937 random(1);
  for (int turn = 0; turn < 3000; ++turn) {
    std::vector<uint8_t> damaged(firstOf(archive).begin(), firstOf(archive).end());
    for (int change = 0; change < 3; ++change) damaged[random() % 500] = static_cast<uint8_t>(random());
    const auto index = PmtilesIndex::open(damaged, archive.size());
    if (!index.ok()) continue;
    for (uint64_t number = 0; number < 400; ++number) {
      const auto found = index->find(tileIdFromPmtiles(number));
      ASSERT_LE(found.place.offset, archive.size());
      ASSERT_LE(found.place.bytes, archive.size() - found.place.offset);
    }
  }
}

}  // namespace
}  // namespace terrane
