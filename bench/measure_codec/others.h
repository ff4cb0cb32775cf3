#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tile_codec.h"

namespace terrane {

/// The codecs to compare with, in the order of the table.
inline constexpr int kOtherCodecs = 5;
std::array<std::unique_ptr<TileCodec>, kOtherCodecs> makeOtherCodecs();

/// What each of the other codecs makes of some tiles.
struct OtherSizes {
  std::array<uint64_t, kOtherCodecs> bytes{};  ///< 0: does not take part
  int64_t dividedTiles = 0;  ///< range beyond 16 bits: coded in quarters by those that hold no more
};

/// Encodes all tiles, on all cores. Sizes found before are taken from `cache`, and new ones left there.
Result<OtherSizes> measureSizes(const std::vector<TileContent>& tiles, nlohmann::json& cache);

/// Some of the tiles, encoded by one codec and ready to be decoded again and again.
class EncodedTiles {
 public:
  /// Encodes at most `most` tiles, evenly spread, and checks that they decode right.
  static Result<EncodedTiles> encode(std::unique_ptr<TileCodec> codec, const std::vector<TileContent>& tiles,
                                     size_t most);
  const TileCodec& codec() const { return *codec_; }
  int64_t samples() const { return samples_; }
  Status decodeAll() const;

 private:
  struct Part {
    std::vector<uint8_t> bytes;
    int cols, rows;
  };
  std::unique_ptr<TileCodec> codec_;
  std::vector<Part> parts_;
  int64_t samples_ = 0;
};

}  // namespace terrane
