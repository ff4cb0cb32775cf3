#pragma once

#include "made_meshes.h"
#include "terrane/gpu/context.h"

namespace terrane {

/// Seconds for all of some meshes, medians of turns that take one way after the other.
struct ExpandingTimes {
  double cpu = 0.0;       ///< expandMeshes(), its checks included; of CPU time, by one thread
  double gpu = 0.0;       ///< MeshExpander::expand(), copying the words and finishing included
  double upload = 0.0;    ///< copying the decoded vertices and 32-bit indices instead, finishing included
  double upload16 = 0.0;  ///< the same with 16-bit indices, as they come from the CPU
};

/// Error: the GPU's; or what it made is not what the CPU made.
Result<ExpandingTimes> measureExpanding(const gpu::Context& context, const MadeMeshes& meshes);

}  // namespace terrane
