#include "tile_codec.h"

#include <algorithm>

namespace terrane {

int64_t TileContent::range() const {
  const auto [low, high] = std::minmax_element(integers.begin(), integers.end());
  return int64_t{*high} - *low;
}

std::vector<uint16_t> asSixteenBits(const TileContent& content) {
  TERRANE_CHECK(content.range() <= 65535, "a range of {}", content.range());
  const int32_t low = *std::min_element(content.integers.begin(), content.integers.end());
  std::vector<uint16_t> samples(content.count());
  std::transform(content.integers.begin(), content.integers.end(), samples.begin(),
                 [&](int32_t value) { return static_cast<uint16_t>(int64_t{value} - low); });
  return samples;
}

bool sameSixteenBits(const TileContent& content, std::span<const uint16_t> samples) {
  const std::vector<uint16_t> expected = asSixteenBits(content);
  return std::equal(expected.begin(), expected.end(), samples.begin(), samples.end());
}

}  // namespace terrane
