#include <cmath>
#include <cstdint>
#include <cstring>

#include "terrane/base/check.h"
#include "terrane/codec/compact_mesh.h"

/// The input is a compact mesh level, in the machine's byte order.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace terrane;
  CompactLevel compact;
  compact.words.resize(size / sizeof(uint32_t));
  if (!compact.words.empty()) std::memcpy(compact.words.data(), data, compact.sizeBytes());
  const auto meshes = expandMeshes(compact);
  TERRANE_CHECK(meshes.ok() == validateCompactLevel(compact).ok());
  if (!meshes.ok()) return 0;

  // Nothing points out of its patch, and the GPU is told the same of it.
  for (size_t i = 0; i < meshes->patches.size(); ++i) {
    const MeshLevel::Patch& patch = meshes->patches[i];
    const CompactPatch told = compactPatch(compact, static_cast<int>(i));
    TERRANE_CHECK(told.vertexCount == patch.vertexCount && 3 * told.triangleCount == patch.indexCount);
    TERRANE_CHECK(told.firstWord + told.wordCount <= compact.words.size());
    for (uint32_t j = 0; j < patch.indexCount; ++j)
      TERRANE_CHECK(meshes->indices[patch.firstIndex + j] < patch.vertexCount);
  }
  for (const PatchVertex& v : meshes->vertices)
    TERRANE_CHECK(v.x() <= kTileCells && v.y() <= kTileCells && std::isfinite(v.heightMeters) &&
                  std::isfinite(v.coarseMeters));
  return 0;
}
