#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "terrane/base/result.h"

/// The entropy coder under the elevation payload: symbols with fixed probabilities by interleaved rANS, and
/// plain bits beside them (docs/format/elevation-v4.md, "Segments").
///
/// The probability tables are the format's own: whole numbers in steps of a quarter octave of their mean
/// size, by a discrete logistic distribution. Which table a symbol uses follows from what is known before it,
/// so a payload carries no table at all.
namespace terrane {

inline constexpr int kProbabilityBits = 12;
inline constexpr uint32_t kProbabilityOne = 1U << kProbabilityBits;

/// A segment's symbols take turns among several coders, so that a processor can work on all of them at once:
/// many where there is much to say, few where their own bytes would count.
inline constexpr unsigned kFewLanes = 2;
inline constexpr unsigned kManyLanes = 16;

/// How widely whole numbers are spread: spread i stands for a mean size of 2^(i / 4 - 4).
inline constexpr int kSpreads = 96;
/// From this spread on, the lowest bits of a number are plain: one more each octave.
inline constexpr int kFirstShiftedSpread = 28;

/// One distribution over tokens: token t < tokens - 1 is the number unzigzag(t), the last one says that a
/// larger number follows in plain bits.
struct TokenTable {
  int tokens = 0;
  std::array<uint16_t, 128> frequency{};
  std::array<uint16_t, 128> start{};
  std::array<float, 128> bits{};  ///< what a token costs
  /// Of each of the 4096 slots: token | isLast << 7 | frequency << 8 | (slot - start) << 20.
  std::array<uint32_t, kProbabilityOne> slots{};
};

/// What a spread means: how many of a number's lowest bits are plain, and the distribution of the rest.
struct SpreadTables {
  std::array<TokenTable, kFirstShiftedSpread + 4> tables;
  std::array<const TokenTable*, kSpreads> bySpread{};
  /// Where a spread's slots begin, counted from the first table's.
  std::array<int32_t, kSpreads> slotsOfSpread{};
  std::array<uint32_t, kSpreads> tokensOfSpread{};
  std::array<uint8_t, kSpreads> plainBitsOfSpread{};

  static constexpr int plainBits(int spread) {
    return spread < kFirstShiftedSpread ? 0 : (spread - kFirstShiftedSpread) / 4 + 1;
  }
  const TokenTable& table(int spread) const { return *bySpread[static_cast<size_t>(spread)]; }
  /// Bits that a number costs, plain ones included; for choosing spreads.
  float cost(int spread, int32_t value) const;
};
/// Made once; the same on every machine: nothing but IEEE additions, multiplications and divisions.
const SpreadTables& spreadTables();

/// Collects a segment's symbols in the order in which they will be read.
class SegmentWriter {
 public:
  /// A whole number, |value| < 2^30.
  void number(int spread, int32_t value);
  void plain(uint32_t value, int bits);
  /// A number that is mostly near zero, in plain bits (Elias gamma of its zigzag + 1).
  void plainNumber(int32_t value);
  size_t symbols() const { return symbols_.size(); }
  /// Appends the segment: varint of 2 * words + isWide, words, varint of plain bytes, plain bytes. Empties
  /// the writer.
  void finish(std::vector<uint8_t>& out);

 private:
  struct Symbol {
    uint16_t frequency;
    uint16_t start;
  };
  std::vector<Symbol> symbols_;
  std::vector<uint8_t> bytes_;
  uint64_t bits_ = 0;
  int bitCount_ = 0;
};

/// Reads a segment. Whatever the bytes are, every call returns some value and nothing beyond the segment is
/// read; finish() tells whether it was one.
class SegmentReader {
 public:
  /// Finds the segment at the beginning of `bytes`; `used` is its length. Errors are relative to `bytes`.
  static Result<SegmentReader> open(std::span<const uint8_t> bytes, size_t& used);

  int32_t number(int spread);
  uint32_t plain(int bits);
  int32_t plainNumber();
  /// `count` numbers at once, at most 512, each with a spread of its own.
  void numbers(const uint8_t* spreads, int count, int32_t* values);
  /// Were all symbols read, as they were written?
  bool finish() const;

 private:
  uint32_t slot(const TokenTable& table);
  void next() { lane_ = lane_ + 1 == lanes_ ? 0 : lane_ + 1; }
  void refill(uint32_t& state);
  void refillPlain();
  int32_t larger(const TokenTable& table);
  /// What goes beyond tokens: larger numbers, and lowest bits.
  void finishNumbers(const uint8_t* spreads, int count, int32_t* values);
  /// The same for those eights of numbers whose bit is set.
  void finishEights(uint64_t eights, const uint8_t* spreads, int32_t* values);

  std::array<uint32_t, kManyLanes> states_{};
  unsigned lanes_ = kFewLanes;
  unsigned lane_ = 0;
  const uint8_t* words_ = nullptr;
  const uint8_t* wordsEnd_ = nullptr;
  const uint8_t* plain_ = nullptr;
  const uint8_t* plainEnd_ = nullptr;
  uint64_t bits_ = 0;
  int bitCount_ = 0;
  bool overrun_ = false;
};

}  // namespace terrane
