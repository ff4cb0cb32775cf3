#include "others.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>

#include "terrane/base/parallel.h"

namespace terrane {
namespace {

/// Changes when a codec or a setting does: sizes measured before no longer count.
constexpr const char* kCacheVersion = "1";

TileContent cutOut(const TileContent& whole, int left, int top, int cols, int rows) {
  TileContent part;
  part.cols = cols;
  part.rows = rows;
  part.boundMeters = whole.boundMeters;
  for (int y = top; y < top + rows; ++y) {
    const ptrdiff_t from = ptrdiff_t{y} * whole.cols + left;
    part.integers.insert(part.integers.end(), whole.integers.begin() + from,
                         whole.integers.begin() + from + cols);
    part.heights.insert(part.heights.end(), whole.heights.begin() + from,
                        whole.heights.begin() + from + cols);
  }
  return part;
}

/// The tile, or as few parts of it as the codec takes: quarters, and quarters of these.
std::vector<TileContent> partsFor(const TileCodec& codec, const TileContent& tile) {
  if (tile.range() <= codec.largestRange()) return {tile};
  std::vector<TileContent> parts;
  const int left = tile.cols / 2;
  const int top = tile.rows / 2;
  for (const int quarter : {0, 1, 2, 3}) {
    const bool east = (quarter & 1) != 0;
    const bool south = (quarter & 2) != 0;
    const int cols = east ? tile.cols - left : left;
    const int rows = south ? tile.rows - top : top;
    if (cols == 0 || rows == 0) continue;
    const TileContent part = cutOut(tile, east ? left : 0, south ? top : 0, cols, rows);
    for (TileContent& piece : partsFor(codec, part)) parts.push_back(std::move(piece));
  }
  return parts;
}

/// LERC's own bound is for bounds.
bool takesPart(int codec, const TileContent& tile) {
  return codec != 4 || tile.boundMeters > 0.0;
}

/// FNV-1a over all that the sizes depend on.
std::string fingerprint(const std::vector<TileContent>& tiles) {
  uint64_t hash = 0xcbf29ce484222325;
  const auto add = [&](const void* data, size_t size) {
    const auto* const bytes = static_cast<const uint8_t*>(data);
    for (size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 0x100000001b3;
  };
  for (const TileContent& tile : tiles) {
    add(&tile.boundMeters, sizeof tile.boundMeters);
    add(tile.integers.data(), tile.integers.size() * sizeof(int32_t));
    if (tile.boundMeters > 0.0) add(tile.heights.data(), tile.heights.size() * sizeof(float));
  }
  return fmt::format("{}-{:016x}", kCacheVersion, hash);
}

}  // namespace

std::array<std::unique_ptr<TileCodec>, kOtherCodecs> makeOtherCodecs() {
  return {makePngCodec(), makeLercCodec(), makeJxlCodec(), makeGradientCodec(), makeLercBoundCodec()};
}

Result<OtherSizes> measureSizes(const std::vector<TileContent>& tiles, nlohmann::json& cache) {
  OtherSizes sizes;
  sizes.dividedTiles =
      std::count_if(tiles.begin(), tiles.end(), [](const TileContent& tile) { return tile.range() > 65535; });
  const std::string key = fingerprint(tiles);
  if (cache.contains(key)) {
    sizes.bytes = cache[key].get<std::array<uint64_t, kOtherCodecs>>();
    return sizes;
  }

  std::array<std::atomic<uint64_t>, kOtherCodecs> sums{};
  std::atomic<size_t> next = 0;
  std::mutex errorMutex;
  std::optional<Error> error;
  const int threads = hardwareThreads();
  parallelFor(threads, threads, [&](int64_t) {
    const auto codecs = makeOtherCodecs();
    for (size_t i = next++; i < tiles.size(); i = next++) {
      for (int codec = 0; codec < kOtherCodecs; ++codec) {
        if (!takesPart(codec, tiles[i])) continue;
        TileCodec& coder = *codecs[static_cast<size_t>(codec)];
        for (const TileContent& part : partsFor(coder, tiles[i])) {
          const auto bytes = coder.encode(part);
          if (bytes.ok()) {
            sums[static_cast<size_t>(codec)] += bytes->size();
          } else {
            const std::lock_guard lock(errorMutex);
            error = bytes.error();
          }
        }
      }
    }
  });
  if (error) return *error;
  for (size_t i = 0; i < sums.size(); ++i) sizes.bytes[i] = sums[i];
  cache[key] = sizes.bytes;
  return sizes;
}

Result<EncodedTiles> EncodedTiles::encode(std::unique_ptr<TileCodec> codec,
                                          const std::vector<TileContent>& tiles, size_t most) {
  EncodedTiles encoded;
  encoded.codec_ = std::move(codec);
  const size_t count = std::min(most, tiles.size());
  for (size_t i = 0; i < count; ++i) {
    const TileContent& tile = tiles[(2 * i + 1) * tiles.size() / (2 * count)];
    for (const TileContent& part : partsFor(*encoded.codec_, tile)) {
      TERRANE_ASSIGN(auto bytes, encoded.codec_->encode(part));
      TERRANE_TRY(encoded.codec_->decode(bytes, part.cols, part.rows));
      if (!encoded.codec_->holds(part)) return makeError("{} changes samples", encoded.codec_->name());
      encoded.parts_.push_back({std::move(bytes), part.cols, part.rows});
    }
    encoded.samples_ += static_cast<int64_t>(tile.count());
  }
  return encoded;
}

Status EncodedTiles::decodeAll() const {
  for (const Part& part : parts_) TERRANE_TRY(codec_->decode(part.bytes, part.cols, part.rows));
  return {};
}

}  // namespace terrane
