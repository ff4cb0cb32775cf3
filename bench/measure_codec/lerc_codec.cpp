#include <Lerc_c_api.h>
#include <zstd.h>

#include <algorithm>
#include <cmath>

#include "tile_codec.h"

namespace terrane {
namespace {

/// What GDAL's COMPRESS=LERC_ZSTD uses.
constexpr int kLercZstdLevel = 9;
constexpr unsigned kInt32 = 4;
constexpr unsigned kFloat32 = 6;

/// A LERC blob within a zstd frame, as in GDAL's LERC_ZSTD, without the TIFF around it.
class Lerc {
 public:
  Result<std::vector<uint8_t>> encode(const void* samples, unsigned type, int cols, int rows,
                                      double largestError) {
    unsigned size = 0;
    if (lerc_computeCompressedSize(samples, type, 1, cols, rows, 1, 0, nullptr, largestError, &size) != 0)
      return makeError("LERC refuses a tile of {} x {} samples", cols, rows);
    blob_.resize(size);
    unsigned written = 0;
    if (lerc_encode(samples, type, 1, cols, rows, 1, 0, nullptr, largestError, blob_.data(), size,
                    &written) != 0)
      return makeError("LERC cannot encode a tile");
    std::vector<uint8_t> bytes(ZSTD_compressBound(written));
    const size_t packed = ZSTD_compress(bytes.data(), bytes.size(), blob_.data(), written, kLercZstdLevel);
    if (ZSTD_isError(packed) != 0) return makeError("zstd: {}", ZSTD_getErrorName(packed));
    bytes.resize(packed);
    return bytes;
  }

  Status decode(std::span<const uint8_t> bytes, void* samples, unsigned type, int cols, int rows) {
    blob_.resize(static_cast<size_t>(ZSTD_getFrameContentSize(bytes.data(), bytes.size())));
    const size_t size = ZSTD_decompress(blob_.data(), blob_.size(), bytes.data(), bytes.size());
    if (ZSTD_isError(size) != 0) return makeError("zstd: {}", ZSTD_getErrorName(size));
    if (lerc_decode(blob_.data(), static_cast<unsigned>(size), 0, nullptr, 1, cols, rows, 1, type, samples) !=
        0)
      return makeError("LERC cannot decode a tile");
    return {};
  }

 private:
  std::vector<uint8_t> blob_;
};

class LercCodec final : public TileCodec {
 public:
  std::string_view name() const override { return "lerc_zstd"; }
  int64_t largestRange() const override { return INT64_MAX; }

  Result<std::vector<uint8_t>> encode(const TileContent& content) override {
    return lerc_.encode(content.integers.data(), kInt32, content.cols, content.rows, 0.0);
  }
  Status decode(std::span<const uint8_t> bytes, int cols, int rows) override {
    decoded_.resize(static_cast<size_t>(cols) * static_cast<size_t>(rows));
    return lerc_.decode(bytes, decoded_.data(), kInt32, cols, rows);
  }
  bool holds(const TileContent& content) const override { return decoded_ == content.integers; }

 private:
  Lerc lerc_;
  std::vector<int32_t> decoded_;
};

class LercBoundCodec final : public TileCodec {
 public:
  std::string_view name() const override { return "lerc_bound"; }
  int64_t largestRange() const override { return INT64_MAX; }

  Result<std::vector<uint8_t>> encode(const TileContent& content) override {
    return lerc_.encode(content.heights.data(), kFloat32, content.cols, content.rows, content.boundMeters);
  }
  Status decode(std::span<const uint8_t> bytes, int cols, int rows) override {
    decoded_.resize(static_cast<size_t>(cols) * static_cast<size_t>(rows));
    return lerc_.decode(bytes, decoded_.data(), kFloat32, cols, rows);
  }
  bool holds(const TileContent& content) const override {
    // note: LERC computes in doubles and rounds to floats at last, by up to half a step of the float.
    return std::equal(decoded_.begin(), decoded_.end(), content.heights.begin(), content.heights.end(),
                      [&](float a, float b) {
                        const double rounding = 1e-7 * (std::abs(a) + content.boundMeters);
                        return std::abs(double{a} - b) <= content.boundMeters + rounding;
                      });
  }

 private:
  Lerc lerc_;
  std::vector<float> decoded_;
};

}  // namespace

std::unique_ptr<TileCodec> makeLercCodec() {
  return std::make_unique<LercCodec>();
}
std::unique_ptr<TileCodec> makeLercBoundCodec() {
  return std::make_unique<LercBoundCodec>();
}

}  // namespace terrane
