#include "block_store.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>

namespace terrane {
namespace {

namespace fs = std::filesystem;

using Values = std::array<uint32_t, 4>;

void fill(BlockStore& store) {
  for (uint32_t block = 0; block < 10; ++block)
    ASSERT_TRUE(store.writeValue(block * 3, Values{block, block + 1, block * block, 7}).ok());
}

void check(const BlockStore& store) {
  for (uint32_t block = 10; block-- > 0;) {
    Values values{};
    ASSERT_TRUE(store.readValue(block * 3, values).ok());
    EXPECT_EQ(values, (Values{block, block + 1, block * block, 7}));
  }
  uint32_t one = 0;
  ASSERT_TRUE(store.read(12, std::as_writable_bytes(std::span(&one, 1)), 8).ok());
  EXPECT_EQ(one, 16U);
}

TEST(BlockStore, KeepsBlocksInAFileWithoutAName) {
  const fs::path folder = fs::path(::testing::TempDir()) / "terrane-block-store";
  fs::create_directories(folder);
  {
    BlockStore store(sizeof(Values), {folder.string(), false}, "test");
    fill(store);
    check(store);
    EXPECT_TRUE(fs::is_empty(folder));
  }
  fs::remove_all(folder);
}

TEST(BlockStore, FindsAgainWhatStays) {
  const fs::path folder = fs::path(::testing::TempDir()) / "terrane-block-store-stays";
  fs::remove_all(folder);
  fs::create_directories(folder);
  {
    BlockStore store(sizeof(Values), {folder.string(), true}, "test");
    fill(store);
  }
  check(BlockStore(sizeof(Values), {folder.string(), true}, "test"));
  fs::remove_all(folder);
}

TEST(BlockStore, SaysWhereItCannotWrite) {
  BlockStore store(8, {"/nonexistent-folder", true}, "test");
  const std::array<uint32_t, 2> values{1, 2};
  const Status status = store.writeValue(0, values);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("/nonexistent-folder"), std::string::npos);
}

}  // namespace
}  // namespace terrane
