#pragma once

#include <algorithm>
#include <cstdint>

#include "terrane/stream/plan_requests.h"

namespace terrane {

/// For so long a request may have the line: what is urgent by then waits for it.
inline constexpr double kHoldSeconds = 0.2;
/// Bytes that nobody wants and a request that brings as many are worth the same: the line's for so long.
inline constexpr double kGapSeconds = 0.004;
/// What may wait does so until a request would have the line for so long.
inline constexpr double kWorthStartingSeconds = 0.03;

/// How large requests should be on a line of some speed: all of a RequestLimits but how much may be started.
/// `usefulBytes`: that may be under way at once.
inline RequestLimits requestSizes(double bytesPerSecond, uint64_t usefulBytes) {
  const auto bytesOf = [&](double seconds) { return static_cast<uint64_t>(seconds * bytesPerSecond); };
  RequestLimits limits;
  // A request should not hold up what becomes urgent while it is on its way.
  limits.bytesARequest =
      std::clamp<uint64_t>(std::min(usefulBytes, bytesOf(kHoldSeconds)), 16U << 10, 512U << 10);
  limits.easyBytes = bytesOf(kHoldSeconds);
  limits.largestGap = std::clamp<uint64_t>(bytesOf(kGapSeconds), 4U << 10, 64U << 10);
  limits.worthStarting = bytesOf(kWorthStartingSeconds);
  return limits;
}

}  // namespace terrane
