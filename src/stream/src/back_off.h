#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace terrane {

/// Tries of the same bytes, in a row: damaged or broken off, and refused by a busy server.
inline constexpr int kMostDamaged = 4;
inline constexpr int kMostBusy = 10;

/// Seconds to wait after so many failures: twice as long each time, and never in step with others.
inline double backOff(int failures, uint64_t salt) {
  const double scatter = 0.75 + 0.5 * static_cast<double>((salt * 0x9e3779b97f4a7c15ULL) >> 40U) / 16777216.0;
  return std::min(8.0, 0.25 * std::ldexp(1.0, std::min(failures - 1, 8))) * scatter;
}

}  // namespace terrane
