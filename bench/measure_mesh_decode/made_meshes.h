#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/compact_mesh.h"
#include "terrane/dataset/manifest.h"

namespace terrane {

/// A mesh level of a tile, in both forms.
struct MadeLevel {
  TileId tile;
  MeshLevel meshes;
  CompactLevel compact;
};

struct MadeMeshes {
  Manifest manifest;
  std::vector<MadeLevel> levels;  ///< parents first, neighbours together; each tile's in their order
  int64_t triangles = 0;
  int64_t vertices = 0;
};

/// The mesh levels of a dataset's tiles, of the finest tiles those beyond their own too, until there are
/// `mostTriangles`. Error: the dataset's.
Result<MadeMeshes> makeMeshes(const std::string& directory, int64_t mostTriangles);

/// The value in the middle; of an even number the lower one. Takes at least one.
double medianOf(std::vector<double> values);

/// The seconds that something takes: by the clock on the wall, and of CPU time of this thread.
template <class Work>
double secondsOf(Work&& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}
double threadSeconds();
template <class Work>
double cpuSecondsOf(Work&& work) {
  const double begin = threadSeconds();
  work();
  return threadSeconds() - begin;
}

}  // namespace terrane
