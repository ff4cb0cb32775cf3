#pragma once

#include <string>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/lod/select_patches.h"

namespace terrane::cli {

/// --size "1280x720": pixels, each 1 to 16384.
Status parsePictureSize(const std::string& text, int& width, int& height);

/// --surface, which has these names, and --k, samples along a patch's side, 2^k + 1: into `selection`, whose
/// metric is known. Error: what does not go together.
inline const std::vector<std::string> kSurfaceNames = {"patches", "meshes"};
Status parseSurface(const std::string& surface, int samplesPerSide, PatchSelection& selection);

}  // namespace terrane::cli
