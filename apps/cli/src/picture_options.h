#pragma once

#include <string>

#include "terrane/base/result.h"
#include "terrane/tiling/lattice.h"

namespace terrane::cli {

/// --size "1280x720": pixels, each 1 to 16384.
Status parsePictureSize(const std::string& text, int& width, int& height);

/// --k: samples along a patch's side, 2^k + 1.
Result<PatchGrid> parsePatchGrid(int samplesPerSide);

}  // namespace terrane::cli
