#include "terrane/render/png.h"

#include <gtest/gtest.h>
#include <png.h>

#include <filesystem>
#include <vector>

namespace terrane {
namespace {

std::vector<uint8_t> gradient(int width, int height, uint8_t alpha) {
  std::vector<uint8_t> out;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (const int value : {x * 3, y * 5, x ^ y, static_cast<int>(alpha)})
        out.push_back(static_cast<uint8_t>(value));
  return out;
}

TEST(Png, WhatIsWrittenReadsBackTheSame) {
  const std::string path = testing::TempDir() + "terrane_png_test.png";
  for (const uint8_t alpha : {uint8_t{255}, uint8_t{100}}) {
    const auto pixels = gradient(37, 21, alpha);
    ASSERT_TRUE(writePng(path, 37, 21, pixels).ok());
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    ASSERT_NE(png_image_begin_read_from_file(&image, path.c_str()), 0);
    EXPECT_EQ((image.format & PNG_FORMAT_FLAG_ALPHA) != 0, alpha != 255);
    image.format = PNG_FORMAT_RGBA;
    std::vector<uint8_t> back(PNG_IMAGE_SIZE(image));
    ASSERT_NE(png_image_finish_read(&image, nullptr, back.data(), 0, nullptr), 0);
    EXPECT_EQ(back, pixels);
    EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  }
  std::filesystem::remove(path);
}

TEST(Png, TellsWhereItCannotWrite) {
  const std::string path = testing::TempDir() + "no/such/folder/picture.png";
  const Status written = writePng(path, 2, 2, gradient(2, 2, 255));
  ASSERT_FALSE(written.ok());
  EXPECT_NE(written.error().message.find(path), std::string::npos);
}

}  // namespace
}  // namespace terrane
