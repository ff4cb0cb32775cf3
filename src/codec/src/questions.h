#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "rans.h"

namespace terrane {

/// The odds that fit counted answers.
inline int oddsOf(uint32_t yes, uint32_t no) {
  const double odds = std::log2((yes + 0.4) / (no + 0.4));
  return std::clamp(static_cast<int>(std::lround(2.0 * odds)) + kOddsSteps / 2, 1, kOddsSteps - 1);
}

/// Questions of one kind, each asked in one of several contexts with odds of its own. Contexts that are asked
/// often get the odds of this tile, the others have usual ones.
template <int Contexts>
struct Questions {
  std::array<std::array<uint32_t, 2>, Contexts> counts{};  ///< no, yes
  std::array<uint8_t, Contexts> odds{};

  /// Chooses odds for what has been counted, and writes them.
  template <class Usual>
  void write(SegmentWriter& out, Usual usual) {
    std::array<int, Contexts> changes{};
    for (int context = 0; context < Contexts; ++context) {
      changes[static_cast<size_t>(context)] = bestChange(context, usual(context));
      odds[static_cast<size_t>(context)] =
          static_cast<uint8_t>(usual(context) + changes[static_cast<size_t>(context)]);
    }
    for (int first = 0; first < Contexts; first += kGroup) {
      const auto begin = changes.begin() + first;
      const auto end = changes.begin() + std::min(first + kGroup, Contexts);
      const bool any = std::any_of(begin, end, [](int change) { return change != 0; });
      out.plain(any ? 1 : 0, 1);
      for (auto change = begin; any && change != end; ++change) out.plainNumber(*change);
    }
  }

  /// Reads them; false where they are none.
  template <class Usual>
  bool read(SegmentReader& in, Usual usual) {
    bool ok = true;
    for (int first = 0; first < Contexts; first += kGroup) {
      const bool any = in.plain(1) != 0;
      for (int context = first; context < std::min(first + kGroup, Contexts); ++context) {
        const int64_t chosen = usual(context) + int64_t{any ? in.plainNumber() : 0};
        ok &= chosen >= 1 && chosen < kOddsSteps;
        odds[static_cast<size_t>(context)] =
            static_cast<uint8_t>(std::clamp<int64_t>(chosen, 1, kOddsSteps - 1));
      }
    }
    return ok;
  }

 private:
  static constexpr int kGroup = 8;

  /// How many steps from the usual odds pay, their own bits counted.
  int bestChange(int context, int usual) const {
    const uint32_t no = counts[static_cast<size_t>(context)][0];
    const uint32_t yes = counts[static_cast<size_t>(context)][1];
    if (no + yes == 0) return 0;
    const auto bitsAt = [&](int step) {
      const double ofYes = spreadTables().yesFrequency[static_cast<size_t>(step)];
      return no * (kProbabilityBits - std::log2(kProbabilityOne - ofYes)) +
             yes * (kProbabilityBits - std::log2(ofYes));
    };
    const int change = oddsOf(yes, no) - usual;
    const int written = 2 * static_cast<int>(std::bit_width(static_cast<uint32_t>(2 * std::abs(change)))) + 1;
    return bitsAt(usual + change) + written < bitsAt(usual) ? change : 0;
  }
};

}  // namespace terrane
