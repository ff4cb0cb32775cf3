#include "terrane/codec/imagery_codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "random_images.h"
#include "resealed.h"

namespace terrane {
namespace {

double meanDifference(const ImageryTile& a, const ImageryTile& b) {
  double sum = 0.0;
  double count = 0.0;
  for (size_t i = 0; i < a.rgba.size(); i += 4) {
    if (a.rgba[i + 3] == 0) continue;
    for (size_t c = 0; c < 3; ++c) sum += std::abs(a.rgba[i + c] - b.rgba[i + c]);
    count += 3.0;
  }
  return sum / count;
}

class ImageryCodec : public ::testing::TestWithParam<ImageryFormat> {};

TEST_P(ImageryCodec, ComesBackNearlyAsItWas) {
  for (const bool holes : {false, true}) {
    const ImageryTile tile = randomImage(1, holes);
    const auto payload = encodeImagery(tile, GetParam(), 85);
    const auto again = decodeImagery(payload);
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_LT(meanDifference(tile, *again), 6.0);
    EXPECT_LT(payload.size(), 60000U);
    // Alpha is kept to the bit.
    for (size_t i = 3; i < tile.rgba.size(); i += 4) ASSERT_EQ(tile.rgba[i], again->rgba[i]) << i / 4;
    EXPECT_EQ(payload, encodeImagery(tile, GetParam(), 85));
  }
}

TEST_P(ImageryCodec, MoreQualityIsNearer) {
  const ImageryTile tile = randomImage(2, false);
  const auto coarse = decodeImagery(encodeImagery(tile, GetParam(), 20));
  const auto fine = decodeImagery(encodeImagery(tile, GetParam(), 95));
  ASSERT_TRUE(coarse.ok() && fine.ok());
  EXPECT_LT(meanDifference(tile, *fine), 0.7 * meanDifference(tile, *coarse));
}

TEST_P(ImageryCodec, EveryTruncatedLengthAndExtraBytesAreErrors) {
  const auto payload = encodeImagery(randomImage(3, true), GetParam(), 30);
  for (size_t length = 0; length < payload.size(); ++length) {
    // note: a copy of that size, so that a sanitizer sees reads beyond it.
    const std::vector<uint8_t> cut(payload.begin(), payload.begin() + static_cast<ptrdiff_t>(length));
    ASSERT_FALSE(decodeImagery(cut).ok()) << length;
    ASSERT_FALSE(decodeImagery(resealed(cut)).ok()) << length;
  }
  auto longer = payload;
  longer.push_back(0);
  EXPECT_FALSE(decodeImagery(longer).ok());
  EXPECT_FALSE(decodeImagery(resealed(longer)).ok());
}

TEST_P(ImageryCodec, WrongHeadsAreErrors) {
  const auto payload = encodeImagery(randomImage(3, true), GetParam(), 30);
  for (const size_t at : {0, 3, 4, 5}) {
    for (int value = 0; value < 256; ++value) {
      auto changed = payload;
      changed[at] = static_cast<uint8_t>(value);
      if (changed[at] == payload[at]) continue;
      ASSERT_FALSE(decodeImagery(resealed(changed)).ok()) << at << " " << value;
    }
  }
  auto newer = payload;
  newer[0] = 3;
  EXPECT_NE(decodeImagery(newer).error().message.find("update Terrane"), std::string::npos);
}

TEST_P(ImageryCodec, DamageIsNoticed) {
  const auto payload = encodeImagery(randomImage(3, true), GetParam(), 30);
  for (size_t at = kCheckOffset; at < payload.size(); at += 1 + at / 16) {
    auto changed = payload;
    changed[at] ^= 16;
    const auto tile = decodeImagery(changed);
    ASSERT_FALSE(tile.ok()) << at;
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, ImageryCodec, ::testing::Values(ImageryFormat::Jpeg, ImageryFormat::Webp));

TEST(ImageryPrefix, EachScanBringsThePictureNearer) {
  for (const bool holes : {false, true}) {
    const ImageryTile tile = randomImage(4, holes);
    const auto payload = encodeImagery(tile, ImageryFormat::Jpeg, 85);
    const auto layout = imageryLayout(payload);
    ASSERT_TRUE(layout.ok());
    EXPECT_EQ(layout->hasMask, holes);
    ASSERT_GE(layout->scanEnds.size(), 4U);
    EXPECT_EQ(layout->scanEnds.back() + 2, payload.size());
    double before = 255.0;
    for (const size_t end : layout->scanEnds) {
      const std::vector<uint8_t> prefix(payload.begin(), payload.begin() + static_cast<ptrdiff_t>(end));
      const auto picture = decodeImageryPrefix(prefix);
      ASSERT_TRUE(picture.ok()) << picture.error().message;
      const double now = meanDifference(tile, *picture);
      EXPECT_LT(now, before);
      before = now;
      for (size_t i = 3; i < tile.rgba.size(); i += 4) ASSERT_EQ(tile.rgba[i], picture->rgba[i]);
    }
    // The plain file lies at the end, as a browser wants it.
    EXPECT_EQ(payload[layout->imageBegin], 0xFF);
    EXPECT_EQ(payload[layout->imageBegin + 1], 0xD8);
    EXPECT_EQ(decodeImageryPrefix(payload)->rgba, decodeImagery(payload)->rgba);
  }
}

TEST(ImageryPrefix, AnyLengthFromTheFirstScanOnGivesAPicture) {
  const auto payload = encodeImagery(randomImage(5, true), ImageryFormat::Jpeg, 40);
  const auto layout = imageryLayout(payload);
  ASSERT_TRUE(layout.ok());
  for (size_t length = 0; length <= payload.size(); length += 7) {
    const std::vector<uint8_t> cut(payload.begin(), payload.begin() + static_cast<ptrdiff_t>(length));
    ASSERT_EQ(decodeImageryPrefix(cut).ok(), length >= layout->scanEnds.front()) << length;
  }
}

TEST(ImageryPrefix, ARootIsAPictureFromItsFirstScanOnWhateverTheFormat) {
  const ImageryTile tile = randomImage(6, true);
  for (const ImageryFormat format : {ImageryFormat::Jpeg, ImageryFormat::Webp}) {
    for (const int quality : {1, defaultImageryQuality(format), 100}) {
      auto root = encodeImageryRoot(tile, format, quality);
      ASSERT_TRUE(decodeImagery(root).ok());
      const auto layout = imageryLayout(root);
      ASSERT_TRUE(layout.ok());
      ASSERT_EQ(layout->format, ImageryFormat::Jpeg);
      root.resize(layout->scanEnds.front());
      EXPECT_TRUE(decodeImageryPrefix(root).ok());
    }
  }
  // Both formats' defaults give the same root.
  EXPECT_EQ(encodeImageryRoot(tile, ImageryFormat::Jpeg, defaultImageryQuality(ImageryFormat::Jpeg)),
            encodeImageryRoot(tile, ImageryFormat::Webp, defaultImageryQuality(ImageryFormat::Webp)));
}

TEST(ImageryPrefix, WebpIsAPictureOnlyWhole) {
  const auto payload = encodeImagery(randomImage(7, true), ImageryFormat::Webp, 40);
  EXPECT_EQ(decodeImageryPrefix(payload)->rgba, decodeImagery(payload)->rgba);
  for (size_t length = 0; length < payload.size(); length += 7) {
    const std::vector<uint8_t> cut(payload.begin(), payload.begin() + static_cast<ptrdiff_t>(length));
    ASSERT_FALSE(decodeImageryPrefix(cut).ok()) << length;
  }
}

TEST(Imagery, CoverIsTold) {
  ImageryTile tile;
  EXPECT_EQ(coverOf(tile), ImageryCover::None);
  tile.rgba[3] = 1;
  EXPECT_EQ(coverOf(tile), ImageryCover::Partial);
  for (size_t i = 3; i < tile.rgba.size(); i += 4) tile.rgba[i] = 255;
  EXPECT_EQ(coverOf(tile), ImageryCover::Full);
  tile.rgba[7] = 254;
  EXPECT_EQ(coverOf(tile), ImageryCover::Partial);
}

TEST(Imagery, TransparentTexelsTakeColoursFromAround) {
  ImageryTile tile;
  const auto set = [&](size_t texel, uint8_t value) {
    for (size_t c = 0; c < 3; ++c) tile.rgba[4 * texel + c] = value;
    tile.rgba[4 * texel + 3] = 255;
  };
  for (size_t i = 0; i < 130 * 256; ++i) set(i, i % 256 < 128 ? 200 : 100);
  fillTransparent(tile);
  for (size_t i = 0; i < static_cast<size_t>(kImageryTexels); ++i) {
    ASSERT_GE(tile.rgba[4 * i], 100) << i;
    ASSERT_LE(tile.rgba[4 * i], 200) << i;
  }
  // Near the edge it is the edge's own colour.
  EXPECT_EQ(tile.rgba[4 * (131 * 256)], 200);
  EXPECT_EQ(tile.rgba[4 * (131 * 256 + 255)], 100);
}

}  // namespace
}  // namespace terrane
