#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "terrane/base/result.h"

/// Other people's codecs behind one interface, each for one tile at a time.
namespace terrane {

/// What the other codecs code: a grid of whole numbers, and the heights that these stand for.
struct TileContent {
  int cols = 0;
  int rows = 0;
  std::vector<int32_t> integers;  ///< row by row; void samples repeat the one before them
  std::vector<float> heights;     ///< metres, void filled likewise
  double boundMeters = 0.0;       ///< what |decoded - height| may reach; 0: the integers are exact

  size_t count() const { return integers.size(); }
  /// Largest minus smallest integer.
  int64_t range() const;
};

/// Encodes and decodes with one library. An object serves one thread and keeps its buffers.
class TileCodec {
 public:
  virtual ~TileCodec() = default;
  virtual std::string_view name() const = 0;
  /// The largest range() that it takes.
  virtual int64_t largestRange() const { return 65535; }
  virtual Result<std::vector<uint8_t>> encode(const TileContent& content) = 0;
  /// Decodes what encode() gave for a tile of this size; the samples stay inside, in the library's own type.
  virtual Status decode(std::span<const uint8_t> bytes, int cols, int rows) = 0;
  /// Are the samples that decode() left right: equal to the integers, less an offset, or within the bound?
  virtual bool holds(const TileContent& content) const = 0;
};

std::unique_ptr<TileCodec> makePngCodec();
std::unique_ptr<TileCodec> makeJxlCodec();
std::unique_ptr<TileCodec> makeGradientCodec();
/// LERC on the integers, and LERC on the heights with its own bound (for boundMeters > 0).
std::unique_ptr<TileCodec> makeLercCodec();
std::unique_ptr<TileCodec> makeLercBoundCodec();

/// The integers less their smallest, which fits 16 bits by the caller's word.
std::vector<uint16_t> asSixteenBits(const TileContent& content);
/// Equal to asSixteenBits()?
bool sameSixteenBits(const TileContent& content, std::span<const uint16_t> samples);

}  // namespace terrane
