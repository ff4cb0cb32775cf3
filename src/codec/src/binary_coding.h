#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "always_inline.h"
#include "terrane/base/result.h"

/// Yes-or-no answers whose odds are learned while they are read: a binary arithmetic coder, models that
/// follow what they have seen, and a mixer that weighs several models by how well they have done
/// (docs/format/elevation-v4.md, "Answers"). Whole numbers only: the same on every machine.
///
/// Coders come as a pair with the same face, so that what is asked in which context is written once, for both
/// ways: code(chance, answer) takes the answer or gives it.
namespace terrane {

/// Chances of a yes are in 1/65536.
inline constexpr int kChanceBits = 16;

/// No answer is impossible.
constexpr uint32_t boundedChance(uint32_t chance) {
  return std::clamp<uint32_t>(chance, 24, 65536 - 24);
}

/// How likely a yes is, from what was answered before.
struct AnswerModel {
  uint16_t chance = 1 << (kChanceBits - 1);
  uint8_t seen = 0;  ///< as many answers have a say

  /// The newest answer counts as one of `seen` + 1.75, of kMostSeen + 1.75 at last.
  static constexpr int kMostSeen = 250;
  void learn(bool yes, int most) {
    static constexpr std::array<uint16_t, kMostSeen + 1> kShare = [] {
      std::array<uint16_t, kMostSeen + 1> made{};
      for (size_t i = 0; i < made.size(); ++i)
        made[i] = static_cast<uint16_t>(32768.0 / (static_cast<double>(i) + 1.75));
      return made;
    }();
    // Seen from its goal, the chance loses its share of the way either way.
    const uint32_t goal = yes ? 65535 : 0;
    const uint32_t way = chance ^ goal;
    chance = static_cast<uint16_t>((way - (way * kShare[seen] >> 15)) ^ goal);
    seen = static_cast<uint8_t>(seen + (seen < most ? 1 : 0));
  }
};

/// Chances on the scale that evidence adds up on, 256 ln(p / (1 - p)), and back.
inline constexpr int kMostEvidence = 2047;
struct EvidenceTables {
  std::array<int16_t, 4096> evidence;  ///< of chances, in 1/4096
  struct Chance {
    uint16_t exact;
    uint16_t bounded;  ///< boundedChance(exact)
  };
  std::array<Chance, 2 * kMostEvidence + 1> chance;  ///< of evidence + kMostEvidence
};
const EvidenceTables& evidenceTables();

TERRANE_INLINE int32_t boundedEvidence(int32_t evidence) {
  // note: it hardly ever is beyond, which is guessed sooner than compared.
  if (static_cast<uint32_t>(evidence + kMostEvidence) > 2 * kMostEvidence) [[unlikely]]
    return evidence < 0 ? -kMostEvidence : kMostEvidence;
  return evidence;
}

/// Divides by a power of two, towards zero.
template <int kBits>
constexpr int32_t dividedBy2ToThe(int32_t value) {
  return (value + ((value >> 31) & ((1 << kBits) - 1))) >> kBits;
}

/// Weighs the evidence of several models, by how well they have done. Weights are in 1/65536.
template <size_t Count>
struct AnswerMixer {
  static constexpr int32_t kMostWeight = 1 << 18;
  static TERRANE_INLINE int32_t bounded(int32_t weight) {
    // note: it hardly ever is beyond, which is guessed sooner than compared.
    if (weight > kMostWeight) [[unlikely]]
      return kMostWeight;
    if (weight < -kMostWeight) [[unlikely]]
      return -kMostWeight;
    return weight;
  }
  std::array<int32_t, Count> weights;
};

/// Several models are asked about one answer. Asking and hearing the answer are two steps: while an answer is
/// still to be known, and perhaps guessed wrong, the next one can be asked for, if it is of other models and
/// of another mixer.
template <size_t Count>
class MixedQuestion {
 public:
  TERRANE_INLINE MixedQuestion(const EvidenceTables& tables, const std::array<AnswerModel*, Count>& models,
                               AnswerMixer<Count>& mixer)
      : models_(models), mixer_(&mixer) {
    static_assert(Count * AnswerMixer<Count>::kMostWeight * kMostEvidence < (1LL << 31), "sums fit");
    int32_t sum = 0;
#pragma GCC unroll 4
    for (size_t i = 0; i < Count; ++i) {
      evidence_[i] = tables.evidence[models[i]->chance >> 4];
      sum += mixer.weights[i] * evidence_[i];
    }
    const int32_t mixed = boundedEvidence(dividedBy2ToThe<16>(sum));
    chance_ = tables.chance[static_cast<size_t>(mixed + kMostEvidence)];
  }

  /// Codes the answer and learns from it.
  template <class Coder>
  TERRANE_INLINE bool code(Coder& coder, int most, bool yes = false) {
    // note: one branch, and what follows from it on either side: what is learned, and what the caller does.
    if (coder.codeOpen(chance_.bounded, yes)) {
      learn(true, most);
      return true;
    }
    learn(false, most);
    return false;
  }

 private:
  TERRANE_INLINE void learn(bool answer, int most) {
    const int32_t miss = (answer ? 65535 : 0) - chance_.exact;
    // note: copies, for the compiler does not know that the models are different ones.
    std::array<int32_t, Count> weights = mixer_->weights;
#pragma GCC unroll 4
    for (size_t i = 0; i < Count; ++i) {
      weights[i] = AnswerMixer<Count>::bounded(weights[i] + dividedBy2ToThe<15>(evidence_[i] * miss));
      AnswerModel model = *models_[i];
      model.learn(answer, most);
      *models_[i] = model;
    }
    mixer_->weights = weights;
  }

  std::array<AnswerModel*, Count> models_;
  AnswerMixer<Count>* mixer_;
  std::array<int32_t, Count> evidence_;
  EvidenceTables::Chance chance_;
};

/// Bits that are as likely 1 as 0, the highest first.
template <class Coder>
inline uint32_t codePlain(Coder& coder, uint32_t value, int bits) {
  uint32_t out = 0;
  for (int bit = bits - 1; bit >= 0; --bit)
    out = out << 1 | (coder.code(1U << (kChanceBits - 1), (value >> bit & 1) != 0) ? 1U : 0U);
  return out;
}
/// A number without much of an expectation: Elias gamma of value + 1, value < 2^29.
template <class Coder>
inline uint32_t codeLarge(Coder& coder, uint32_t value) {
  const int width = std::bit_width(value + 1);
  int w = 1;
  while (w < 30 && coder.code(1U << (kChanceBits - 1), w < width)) ++w;
  return (codePlain(coder, value + 1, w - 1) | 1U << (w - 1)) - 1;
}

/// Writes answers; the bytes stand once finish() was called.
class BinaryWriter {
 public:
  static constexpr bool kReads = false;
  bool code(uint32_t chance, bool yes) {
    const uint32_t share = (range_ >> kChanceBits) * boundedChance(chance);
    if (yes) {
      range_ = share;
    } else {
      low_ += share;
      range_ -= share;
    }
    while (range_ < 1U << 24) {
      shiftLow();
      range_ <<= 8;
    }
    return yes;
  }
  bool codeOpen(uint32_t chance, bool yes) { return code(chance, yes); }
  /// Appends a varint of the number of bytes, and the bytes. Empties the writer.
  void finish(std::vector<uint8_t>& out);

 private:
  void shiftLow();

  uint64_t low_ = 0;
  uint32_t range_ = 0xffffffffU;
  uint8_t held_ = 0;
  uint64_t heldCount_ = 1;
  std::vector<uint8_t> bytes_;
};

/// Reads what a BinaryWriter wrote. Whatever the bytes are, every call returns some answer and nothing beyond
/// them is read; finish() tells whether they were what was written.
class BinaryReader {
 public:
  static constexpr bool kReads = true;
  /// Finds the answers at the beginning of `bytes`; `used` is their length. Errors are relative to `bytes`.
  static Result<BinaryReader> open(std::span<const uint8_t> bytes, size_t& used);

  TERRANE_INLINE bool code(uint32_t chance, bool = false) {
    const uint32_t share = (range_ >> kChanceBits) * boundedChance(chance);
    const uint64_t wideShare = uint64_t{share} << 32;
    const bool yes = code_ < wideShare;
    if (yes) {
      range_ = share;
    } else {
      range_ -= share;
      code_ -= wideShare;
    }
    if (range_ < 1U << 24) normalise();
    return yes;
  }
  /// The same for an answer that is hard to guess, with a chance that is bounded.
  TERRANE_INLINE bool codeOpen(uint32_t chance, bool = false) {
    const uint32_t share = (range_ >> kChanceBits) * chance;
    const uint64_t wideShare = uint64_t{share} << 32;
    if (code_ < wideShare) {
      range_ = share;
      normalise();
      return true;
    }
    range_ -= share;
    code_ -= wideShare;
    normalise();
    return false;
  }
  bool finish() const { return taken_ - static_cast<size_t>(ahead_ / 8) >= size_; }

 private:
  /// note: the range has not become less than 24 * 256: it takes two bytes at most.
  TERRANE_INLINE void normalise() {
    const int shift = std::countl_zero(range_) & 24;
    range_ <<= shift;
    code_ <<= shift;
    ahead_ -= shift;
    if (ahead_ < 0) refill();
  }
  /// Takes four more bytes, beyond the end zeros.
  void refill() {
    uint32_t four = 0;
    for (size_t i = taken_; i < taken_ + 4; ++i) four = four << 8 | (i < size_ ? bytes_[i] : 0U);
    taken_ += 4;
    code_ |= uint64_t{four} << -ahead_;
    ahead_ += 32;
  }

  const uint8_t* bytes_ = nullptr;
  size_t size_ = 0;
  size_t taken_ = 0;  ///< bytes, those beyond the end as well
  uint32_t range_ = 0xffffffffU;
  int ahead_ = -32;    ///< as many bits of `code_` below its upper half are bytes that come later
  uint64_t code_ = 0;  ///< the code is its upper half
};

}  // namespace terrane
