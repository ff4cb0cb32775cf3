#pragma once

#include <cmath>

namespace terrane {

/// A channel of a colour, 0 to 1, out of sRGB's curve.
inline float linearFromSrgb(float c) {
  return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
}

}  // namespace terrane
