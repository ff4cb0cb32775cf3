#include "picture_options.h"

#include <cstdio>

namespace terrane::cli {

Status parsePictureSize(const std::string& text, int& width, int& height) {
  char tail = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &tail) != 2 || width < 1 || height < 1 ||
      width > 16384 || height > 16384) {
    return makeError("--size {}: expected WIDTHxHEIGHT in pixels, each 1 to 16384", text);
  }
  return {};
}

Result<PatchGrid> parsePatchGrid(int samplesPerSide) {
  for (int k = PatchGrid::kSmallest; k <= PatchGrid::kLargest; ++k) {
    if (PatchGrid{k}.samplesPerSide() == samplesPerSide) return PatchGrid{k};
  }
  return makeError("--k {}: expected 2^k + 1 from 3 to 129, such as 17 or 33", samplesPerSide);
}

}  // namespace terrane::cli
