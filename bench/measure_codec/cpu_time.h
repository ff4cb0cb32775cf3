#pragma once

#include <algorithm>
#include <vector>

#include "terrane/base/result.h"

/// What calls cost, in CPU time of one thread. It is measured in turns, and the median counts.
namespace terrane {

inline constexpr int kTurns = 5;
/// A turn takes at least so long.
inline constexpr double kShortestSeconds = 0.04;

/// CPU seconds of the calling thread so far; in WebAssembly, of all of node.
double threadSeconds();

/// CPU seconds of one call, over as many calls as take a while.
template <class Body>
Result<double> secondsOf(const Body& body) {
  const double begin = threadSeconds();
  int calls = 0;
  double seconds = 0.0;
  do {
    TERRANE_TRY(body());
    ++calls;
    seconds = threadSeconds() - begin;
  } while (seconds < kShortestSeconds);
  return seconds / calls;
}

/// The upper one of the two in the middle where there are two; `values` must not be empty.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace terrane
