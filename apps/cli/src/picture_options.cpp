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

Status parseSurface(const std::string& surface, int samplesPerSide, PatchSelection& selection) {
  selection.surface = surface == "meshes" ? SurfaceKind::Meshes : SurfaceKind::Patches;
  if (selection.surface == SurfaceKind::Meshes && selection.metric != SplitMetric::Full)
    return makeError("--metric shows how K-patches are split: pass --surface patches with it");
  for (int k = PatchGrid::kSmallest; k <= PatchGrid::kLargest; ++k) {
    if (PatchGrid{k}.samplesPerSide() != samplesPerSide) continue;
    selection.grid.k = k;
    return {};
  }
  return makeError("--k {}: expected 2^k + 1 from 3 to 129, such as 17 or 33", samplesPerSide);
}

}  // namespace terrane::cli
