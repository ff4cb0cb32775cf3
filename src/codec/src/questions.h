#pragma once

#include <algorithm>
#include <array>
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

/// Questions of one kind with their contexts, counted before they are written.
template <int Contexts>
struct Questions {
  std::array<std::array<uint32_t, 2>, Contexts> counts{};
  std::array<uint8_t, Contexts> odds{};

  template <class Usual>
  void write(SegmentWriter& out, Usual usual) {
    for (int context = 0; context < Contexts; ++context) {
      const auto& [no, yes] = counts[static_cast<size_t>(context)];
      int chosen = usual(context);
      // Few answers are not worth odds of their own.
      if (no + yes > 12) chosen = oddsOf(yes, no);
      odds[static_cast<size_t>(context)] = static_cast<uint8_t>(chosen);
      out.plainNumber(chosen - usual(context));
    }
  }
  template <class Usual>
  bool read(SegmentReader& in, Usual usual) {
    bool ok = true;
    for (int context = 0; context < Contexts; ++context) {
      const int chosen = usual(context) + in.plainNumber();
      ok &= chosen >= 1 && chosen < kOddsSteps;
      odds[static_cast<size_t>(context)] = static_cast<uint8_t>(std::clamp(chosen, 1, kOddsSteps - 1));
    }
    return ok;
  }
};

}  // namespace terrane
