#include <algorithm>
#include <array>
#include <cmath>

#include "terrane/codec/tile.h"

namespace terrane {
namespace {

/// 2^(i / 8), so that no machine's exp2() has a say in what a code means.
constexpr std::array<double, 8> kEighthPowers = {1.0,
                                                 1.0905077326652577,
                                                 1.189207115002721,
                                                 1.2968395546510096,
                                                 1.4142135623730951,
                                                 1.5422108254079407,
                                                 1.681792830507429,
                                                 1.8340080864093424};

constexpr int kLargestRangeCode = 65535;

}  // namespace

int64_t ElevationScale::integerFromHeight(double heightMeters) const {
  return static_cast<int64_t>(std::llround((heightMeters - heightOffset) / heightStep));
}

double ElevationScale::errorFromCode(uint8_t code) const {
  if (code == 0) return 0.0;
  const int eighths = code - 1;
  return errorUnit * std::ldexp(kEighthPowers[static_cast<size_t>(eighths % 8)], eighths / 8);
}

uint8_t ElevationScale::codeFromError(double errorMeters) const {
  // note: written so that NaN claims everything.
  int low = 0;
  int high = 255;
  while (low < high) {
    const int middle = (low + high) / 2;
    if (errorFromCode(static_cast<uint8_t>(middle)) >= errorMeters) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return static_cast<uint8_t>(low);
}

uint16_t ElevationScale::lowCode(double heightMeters) const {
  // The division may be off by a rounding, the comparison is what counts.
  const double guess = (heightMeters - rangeBase) / rangeUnit;
  int code = static_cast<int>(std::clamp(guess, 0.0, static_cast<double>(kLargestRangeCode)));
  while (code > 0 && heightFromRangeCode(static_cast<uint16_t>(code)) > heightMeters) --code;
  while (code < kLargestRangeCode && heightFromRangeCode(static_cast<uint16_t>(code + 1)) <= heightMeters)
    ++code;
  return static_cast<uint16_t>(code);
}

uint16_t ElevationScale::highCode(double heightMeters) const {
  const double guess = (heightMeters - rangeBase) / rangeUnit;
  int code = static_cast<int>(std::clamp(guess, 0.0, static_cast<double>(kLargestRangeCode)));
  while (code < kLargestRangeCode && heightFromRangeCode(static_cast<uint16_t>(code)) < heightMeters) ++code;
  while (code > 0 && heightFromRangeCode(static_cast<uint16_t>(code - 1)) >= heightMeters) --code;
  return static_cast<uint16_t>(code);
}

}  // namespace terrane
