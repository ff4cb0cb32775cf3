#include "block_store.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>

namespace terrane {
namespace {

TEST(BlockStore, KeepsBlocksInMemoryAndBeyondIt) {
  const std::string folder = ::testing::TempDir();
  BlockStore store(4 * sizeof(uint32_t), 3 * 4 * sizeof(uint32_t), folder);
  for (uint32_t block = 0; block < 10; ++block) {
    const std::array<uint32_t, 4> values{block, block + 1, block * block, 7};
    ASSERT_TRUE(store.writeValues<uint32_t>(block, values).ok());
  }
  for (uint32_t block = 10; block-- > 0;) {
    std::array<uint32_t, 4> values{};
    ASSERT_TRUE(store.readValues<uint32_t>(block, values).ok());
    EXPECT_EQ(values, (std::array<uint32_t, 4>{block, block + 1, block * block, 7}));
  }
}

TEST(BlockStore, SaysWhereItCannotWrite) {
  BlockStore store(8, 0, "/nonexistent-folder");
  const std::array<uint32_t, 2> values{1, 2};
  const Status status = store.writeValues<uint32_t>(0, values);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("/nonexistent-folder"), std::string::npos);
}

}  // namespace
}  // namespace terrane
