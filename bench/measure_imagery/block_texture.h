#pragma once

#include <cstdint>
#include <vector>

namespace terrane {

/// An RGBA picture through BC1 and back: every block of 4 x 4 texels becomes eight bytes, its colours on a
/// line between the ends of their range (range fit). `width` and `height` are multiples of 4; alpha is left
/// as it is.
std::vector<uint8_t> throughBc1(const std::vector<uint8_t>& rgba, int width, int height);

}  // namespace terrane
