#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrane/base/result.h"

namespace terrane {

/// An sRGB picture as the bytes of a PNG file. `rgba`: width * height * 4 bytes, row by row from the top;
/// where every pixel is opaque the file has no alpha.
std::vector<uint8_t> encodePng(int width, int height, std::span<const uint8_t> rgba);

/// Writes an sRGB picture as a PNG file, replacing one that is there only when all is written; see
/// encodePng().
Status writePng(const std::string& path, int width, int height, std::span<const uint8_t> rgba);

}  // namespace terrane
