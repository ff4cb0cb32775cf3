#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "rans.h"
#include "sample_prediction.h"

namespace terrane {

/// How often each small number stands in each context, to choose spreads by.
class SpreadChooser {
 public:
  void add(const std::vector<uint8_t>& contexts, const std::vector<int32_t>& residuals) {
    for (size_t i = 0; i < residuals.size(); ++i) {
      const auto size = static_cast<uint32_t>(std::abs(residuals[i]));
      ++counts_[contexts[i]][std::min(size, kBins - 1)];
      sizes_[contexts[i]] += size;
    }
  }

  SpreadShifts choose() const {
    SpreadShifts shifts{};
    int last = 0;
    for (int octave = 0; octave < kOctaves; ++octave) {
      uint64_t count = 0;
      uint64_t size = 0;
      for (size_t context = 4 * static_cast<size_t>(octave); context < 4 * static_cast<size_t>(octave) + 4;
           ++context) {
        for (const uint32_t n : counts_[context]) count += n;
        size += sizes_[context];
      }
      if (count > 0) last = bestShift(octave, static_cast<double>(size) / static_cast<double>(count), last);
      shifts[static_cast<size_t>(octave)] = static_cast<int8_t>(last);
    }
    return shifts;
  }

 private:
  static constexpr uint32_t kBins = 64;

  int bestShift(int octave, double meanSize, int last) const {
    // Where numbers are large, their mean size says it all.
    const double middle = 4.0 * (std::log2(std::max(meanSize, 0.02)) + 4.0);
    const int guess = std::clamp(static_cast<int>(std::lround(middle - 4 * octave - 1.5)), -60, 60);
    if (meanSize > 8.0) return guess;
    const auto costOf = [&](int shift) {
      double bits = 1.0 + 2.0 * std::bit_width(static_cast<uint32_t>(2 * std::abs(shift - last)));
      for (int context = 4 * octave; context < 4 * octave + 4; ++context) {
        const int spread = std::clamp(context + shift, 0, kSpreads - 1);
        const auto& costs = costTable()[static_cast<size_t>(spread)];
        const auto& counts = counts_[static_cast<size_t>(context)];
        for (size_t i = 0; i < kBins; ++i) bits += static_cast<double>(costs[i]) * counts[i];
      }
      return bits;
    };
    int best = last;
    double least = costOf(last);
    for (int shift = guess - 3; shift <= guess + 3; ++shift) {
      const double bits = costOf(shift);
      if (bits < least) {
        least = bits;
        best = shift;
      }
    }
    return best;
  }

  using CostTable = std::array<std::array<float, kBins>, kSpreads>;
  static const CostTable& costTable() {
    static const CostTable table = [] {
      CostTable made;
      for (size_t spread = 0; spread < kSpreads; ++spread) {
        for (size_t size = 0; size < kBins; ++size) {
          const auto value = static_cast<int32_t>(size);
          const float bits = spreadTables().cost(static_cast<int>(spread), value) +
                             spreadTables().cost(static_cast<int>(spread), -value);
          made[spread][size] = 0.5F * bits;
        }
      }
      return made;
    }();
    return table;
  }

  std::array<std::array<uint32_t, kBins>, kSizeContexts> counts_{};
  std::array<uint64_t, kSizeContexts> sizes_{};
};

}  // namespace terrane
