#include <zstd.h>

#include <algorithm>

#include "tile_codec.h"

namespace terrane {
namespace {

constexpr int kZstdLevel = 19;

/// The gradient predictor of JPEG-LS: the plane through west, north and north-west, held between west and
/// north. Outside the tile, the neighbour inside stands in.
inline int predict(int west, int north, int northWest) {
  const int low = std::min(west, north);
  const int high = std::max(west, north);
  return std::clamp(west + north - northWest, low, high);
}

inline int predictAt(const uint16_t* samples, int cols, int x, int y) {
  const uint16_t* const here = samples + static_cast<ptrdiff_t>(y) * cols + x;
  if (y == 0) return x == 0 ? 0 : here[-1];
  return x == 0 ? here[-cols] : predict(here[-1], here[-cols], here[-cols - 1]);
}

/// Residuals of the gradient predictor, small ones of either sign to small numbers, low bytes and high bytes
/// apart, through zstd.
class GradientCodec final : public TileCodec {
 public:
  std::string_view name() const override { return "zstd_gradient"; }

  Result<std::vector<uint8_t>> encode(const TileContent& content) override {
    const std::vector<uint16_t> samples = asSixteenBits(content);
    planes_.resize(2 * samples.size());
    size_t at = 0;
    for (int y = 0; y < content.rows; ++y) {
      for (int x = 0; x < content.cols; ++x, ++at) {
        const auto residual =
            static_cast<int16_t>(samples[at] - predictAt(samples.data(), content.cols, x, y));
        const auto folded = static_cast<uint16_t>(residual * 2 ^ residual >> 15);
        planes_[at] = static_cast<uint8_t>(folded);
        planes_[samples.size() + at] = static_cast<uint8_t>(folded >> 8);
      }
    }
    std::vector<uint8_t> bytes(ZSTD_compressBound(planes_.size()));
    const size_t packed =
        ZSTD_compress(bytes.data(), bytes.size(), planes_.data(), planes_.size(), kZstdLevel);
    if (ZSTD_isError(packed) != 0) return makeError("zstd: {}", ZSTD_getErrorName(packed));
    bytes.resize(packed);
    return bytes;
  }

  Status decode(std::span<const uint8_t> bytes, int cols, int rows) override {
    const size_t count = static_cast<size_t>(cols) * static_cast<size_t>(rows);
    decoded_.resize(count);
    planes_.resize(2 * count);
    const size_t size = ZSTD_decompress(planes_.data(), planes_.size(), bytes.data(), bytes.size());
    if (ZSTD_isError(size) != 0 || size != planes_.size()) return makeError("zstd cannot decode a tile");
    const uint8_t* const low = planes_.data();
    const uint8_t* const high = low + count;
    const auto residualAt = [&](size_t at) {
      const int folded = low[at] | high[at] << 8;
      return folded >> 1 ^ -(folded & 1);
    };
    size_t at = 0;
    for (int x = 0; x < cols; ++x, ++at)
      decoded_[at] = static_cast<uint16_t>(predictAt(decoded_.data(), cols, x, 0) + residualAt(at));
    for (int y = 1; y < rows; ++y) {
      const uint16_t* const north = decoded_.data() + at - cols;
      int west = decoded_[at] = static_cast<uint16_t>(north[0] + residualAt(at));
      ++at;
      for (int x = 1; x < cols; ++x, ++at) {
        west = static_cast<uint16_t>(predict(west, north[x], north[x - 1]) + residualAt(at));
        decoded_[at] = static_cast<uint16_t>(west);
      }
    }
    return {};
  }

  bool holds(const TileContent& content) const override { return sameSixteenBits(content, decoded_); }

 private:
  std::vector<uint8_t> planes_;
  std::vector<uint16_t> decoded_;
};

}  // namespace

std::unique_ptr<TileCodec> makeGradientCodec() {
  return std::make_unique<GradientCodec>();
}

}  // namespace terrane
