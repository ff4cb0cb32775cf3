#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/base/result.h"

namespace terrane {

/// A progressive JPEG file (4:2:0) of a tile's colours; `rgba` has four bytes a texel, the fourth is not
/// looked at.
std::vector<uint8_t> encodeJpeg(std::span<const uint8_t> rgba, int quality);

/// Where the scans of a JPEG file end: in front of the next scan's tables, the last in front of the end
/// marker. Empty where the bytes are no such file.
std::vector<size_t> jpegScanEnds(std::span<const uint8_t> file);

/// Decodes a JPEG file of a tile's size into four bytes a texel, the fourth 255. Errors: anything that the
/// decoder finds to remark upon.
Status decodeJpeg(std::span<const uint8_t> file, std::span<uint8_t> rgba);

}  // namespace terrane
