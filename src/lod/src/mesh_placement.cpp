#include "terrane/lod/mesh_placement.h"

namespace terrane {

int64_t triangleCount(const Cut& cut) {
  if (cut.surface == SurfaceKind::Patches)
    return static_cast<int64_t>(cut.patches.size()) * cut.grid.trianglesPerPatch();
  int64_t out = 0;
  for (const Patch& patch : cut.patches) out += patch.triangles;
  return out;
}

}  // namespace terrane
