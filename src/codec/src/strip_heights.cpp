#include "strip_heights.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane {

namespace {

/// Each row by itself: the last known one to the west, else the first to the east; is any known?
bool fillRow(std::span<float> row) {
  const auto first = std::find_if(row.begin(), row.end(), [](float height) { return !std::isnan(height); });
  if (first == row.end()) return false;
  std::fill(row.begin(), first, *first);
  float last = *first;
  for (float& height : row) {
    if (std::isnan(height)) height = last;
    last = height;
  }
  return true;
}

/// Heights for what is not known. Precondition: something is.
std::vector<float> filled(std::vector<float> heights, size_t side) {
  const std::span<float> all(heights);
  size_t firstKnown = side;
  for (size_t y = 0; y < side; ++y) {
    if (fillRow(all.subspan(y * side, side))) {
      firstKnown = std::min(firstKnown, y);
    } else if (firstKnown < y) {
      std::copy_n(all.begin() + (y - 1) * side, side, all.begin() + y * side);
    }
  }
  for (size_t y = 0; y < firstKnown; ++y)
    std::copy_n(all.begin() + firstKnown * side, side, all.begin() + y * side);
  return heights;
}

}  // namespace

Result<StripHeights> quantizeStripHeights(std::span<const float> heights, int side,
                                          const StripMeshOptions& options) {
  StripHeights out;
  out.known.assign(heights.begin(), heights.end());
  out.q.assign(heights.size(), 0);
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  bool hasGaps = false;
  for (float& height : out.known) {
    if (std::isfinite(height)) {
      lowest = std::min<double>(lowest, height);
      highest = std::max<double>(highest, height);
    } else {
      height = std::numeric_limits<float>::quiet_NaN();
      hasGaps = true;
    }
  }
  if (lowest > highest) return out;

  // note: by doubling, not by a logarithm, so that a range of just 2^k steps gets k bits on every machine. A
  // tiny bound ends at some number of bits that no vertex has.
  const double range = highest - lowest;
  const double quantization =
      options.quantizationMeters > 0.0 ? options.quantizationMeters : options.boundMeters / 4.0;
  while (out.bits < 64 && std::ldexp(2.0 * quantization, out.bits) < range) ++out.bits;

  const std::vector<float> whole = hasGaps ? filled(out.known, static_cast<size_t>(side)) : out.known;
  for (;; ++out.bits) {
    if (out.bits > kMaxStripHeightBits)
      return makeError("heights from {} to {} m need {} bits to be within {} m, a strip mesh has {}", lowest,
                       highest, out.bits, quantization, kMaxStripHeightBits);
    out.stepMeters = std::ldexp(range, -out.bits);
    out.baseMeters = lowest + out.stepMeters / 2.0;
    const auto last = static_cast<double>((1 << out.bits) - 1);
    const double perMeter = out.stepMeters > 0.0 ? 1.0 / out.stepMeters : 0.0;
    double worst = 0.0;
    for (size_t i = 0; i < whole.size(); ++i) {
      const double q = std::min(std::floor((whole[i] - lowest) * perMeter), last);
      worst = std::max(worst, std::abs(out.baseMeters + q * out.stepMeters - whole[i]));
      out.q[i] = static_cast<uint16_t>(q);
    }
    // Where the quantisation may take all of the bound, rounding must not take more.
    if (worst <= options.boundMeters) return out;
  }
}

}  // namespace terrane
