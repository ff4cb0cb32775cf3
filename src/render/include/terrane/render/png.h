#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "terrane/base/result.h"

namespace terrane {

/// Writes an sRGB picture as a PNG file, replacing one that is there only when all is written. `rgba`: width
/// * height * 4 bytes, row by row from the top; where every pixel is opaque the file has no alpha.
Status writePng(const std::string& path, int width, int height, std::span<const uint8_t> rgba);

}  // namespace terrane
