#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "always_inline.h"

namespace terrane {

/// A bit for each sample of a grid's row, and for some beyond its ends: what is asked of many samples at
/// once, or of those around one. All bits are 0 at first.
class RowBits {
 public:
  bool at(int x) const { return (words_[wordOf(x)] >> shiftOf(x) & 1) != 0; }
  void set(int x) { words_[wordOf(x)] |= uint64_t{1} << shiftOf(x); }
  /// Up to 16 of them from x on, a multiple of 16, the first one lowest.
  void setRun(int x, uint32_t bits) { words_[wordOf(x)] |= uint64_t{bits} << shiftOf(x); }
  void clear() { words_ = {}; }

  /// Up to 32 of them from x on, the first one lowest.
  uint32_t from(int x, int count) const {
    const size_t word = wordOf(x);
    const int shift = shiftOf(x);
    uint64_t bits = words_[word] >> shift;
    if (shift > 32) bits |= words_[word + 1] << (64 - shift);
    return static_cast<uint32_t>(bits & ((uint64_t{1} << count) - 1));
  }
  /// Those from x on, the first one lowest; 24 are right, whatever is above.
  uint32_t around(int x) const {
    static_assert(std::endian::native == std::endian::little);
    const auto at = static_cast<size_t>(x + kMargin);
    uint32_t bits;
    std::memcpy(&bits, reinterpret_cast<const char*>(words_.data()) + at / 8, sizeof(bits));
    return bits >> (at % 8);
  }
  bool any() const { return (words_[0] | words_[1] | words_[2]) != 0; }
  /// Calls visit(x) for each that is set.
  template <class Visit>
  TERRANE_INLINE void forEach(Visit&& visit) const {
    for (size_t i = 0; i < kWords; ++i) {
      for (uint64_t left = words_[i]; left != 0; left &= left - 1)
        visit(static_cast<int>(64 * i) + std::countr_zero(left) - kMargin);
    }
  }
  /// A bit for each eight samples: is any of them set?
  uint32_t eights() const {
    constexpr uint64_t kLow = 0x7f7f7f7f7f7f7f7fU;
    uint64_t found = 0;
    for (size_t i = 0; i < 3; ++i) {
      const uint64_t any = (((words_[i] & kLow) + kLow) | words_[i]) & ~kLow;
      found |= ((any >> 7) * 0x0102040810204080U >> 56) << (8 * i);
    }
    return static_cast<uint32_t>(found >> (kMargin / 8));
  }

  /// What the next sample to the east has, and to the west.
  RowBits fromEast() const {
    RowBits out;
    for (size_t i = 0; i + 1 < kWords; ++i) out.words_[i] = words_[i] >> 1 | words_[i + 1] << 63;
    out.words_[kWords - 1] = words_[kWords - 1] >> 1;
    return out;
  }
  RowBits fromWest() const {
    RowBits out;
    out.words_[0] = words_[0] << 1;
    for (size_t i = 1; i < kWords; ++i) out.words_[i] = words_[i] << 1 | words_[i - 1] >> 63;
    return out;
  }
  RowBits operator|(const RowBits& b) const {
    return combined(b, [](uint64_t x, uint64_t y) { return x | y; });
  }
  RowBits operator&(const RowBits& b) const {
    return combined(b, [](uint64_t x, uint64_t y) { return x & y; });
  }
  RowBits operator~() const {
    return combined(*this, [](uint64_t x, uint64_t) { return ~x; });
  }

  /// The first `count` samples.
  static RowBits first(int count) {
    RowBits out;
    for (int x = 0; x < count; x += 16) out.setRun(x, (1U << std::min(16, count - x)) - 1);
    return out;
  }
  /// Every second sample, beyond the ends as well.
  static RowBits even() {
    RowBits out;
    out.words_.fill(0x5555555555555555U);
    return out;
  }

 private:
  static constexpr int kMargin = 16;
  static constexpr size_t kWords = 4;  ///< 129 samples at most, and what is looked at beyond

  static size_t wordOf(int x) { return static_cast<size_t>(x + kMargin) / 64; }
  static int shiftOf(int x) { return (x + kMargin) % 64; }
  template <class Combine>
  RowBits combined(const RowBits& b, Combine&& combine) const {
    RowBits out;
    for (size_t i = 0; i < kWords; ++i) out.words_[i] = combine(words_[i], b.words_[i]);
    return out;
  }

  std::array<uint64_t, kWords> words_{};
};

}  // namespace terrane
