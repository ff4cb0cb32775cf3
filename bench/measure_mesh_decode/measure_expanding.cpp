#include "measure_expanding.h"

#include <cstring>

#include "mesh_expander.h"

namespace terrane {

namespace {

constexpr int kExpandingTurns = 7;

/// All meshes as they lie on the GPU, one after the other.
struct Decoded {
  std::vector<PatchVertex> vertices;
  std::vector<uint32_t> indices;
  std::vector<uint16_t> indices16;
  std::vector<MeshExpander::Job> jobs;
};
Decoded decodedOf(const MadeMeshes& meshes) {
  Decoded out;
  for (const MadeLevel& level : meshes.levels) {
    for (size_t i = 0; i < level.meshes.patches.size(); ++i) {
      const MeshLevel::Patch& patch = level.meshes.patches[i];
      const auto base = static_cast<uint32_t>(out.vertices.size());
      out.jobs.push_back({.level = &level.compact,
                          .patch = static_cast<int>(i),
                          .firstVertex = base,
                          .firstIndex = static_cast<uint32_t>(out.indices.size())});
      const auto vertices = level.meshes.vertices.begin() + patch.firstVertex;
      out.vertices.insert(out.vertices.end(), vertices, vertices + patch.vertexCount);
      for (uint32_t j = 0; j < patch.indexCount; ++j)
        out.indices.push_back(base + level.meshes.indices[patch.firstIndex + j]);
    }
    out.indices16.insert(out.indices16.end(), level.meshes.indices.begin(), level.meshes.indices.end());
  }
  return out;
}

template <class T>
bool holds(const gpu::StorageBuffer& buffer, const std::vector<T>& expected) {
  std::vector<T> read(expected.size());
  buffer.read(read.data(), read.size() * sizeof(T));
  return std::memcmp(read.data(), expected.data(), read.size() * sizeof(T)) == 0;
}

}  // namespace

Result<ExpandingTimes> measureExpanding(const gpu::Context& context, const MadeMeshes& meshes) {
  TERRANE_ASSIGN(MeshExpander expander, MeshExpander::create(context));
  const Decoded decoded = decodedOf(meshes);
  const size_t vertexBytes = decoded.vertices.size() * sizeof(PatchVertex);
  const size_t indexBytes = decoded.indices.size() * sizeof(uint32_t);
  gpu::StorageBuffer vertices, indices, rawVertices, rawIndices;
  vertices.upload(nullptr, vertexBytes);
  indices.upload(nullptr, indexBytes);

  std::vector<double> cpu, gpu, upload, upload16;
  Status status;
  for (int turn = 0; turn < kExpandingTurns && status.ok(); ++turn) {
    cpu.push_back(cpuSecondsOf([&] {
      for (const MadeLevel& level : meshes.levels)
        if (const auto expanded = expandMeshes(level.compact); !expanded.ok()) status = expanded.error();
    }));
    glFinish();
    gpu.push_back(secondsOf([&] {
      if (const Status done = expander.expand(context, decoded.jobs, vertices.name(), indices.name());
          !done.ok())
        status = done;
      glFinish();
    }));
    upload.push_back(secondsOf([&] {
      rawVertices.upload(decoded.vertices.data(), vertexBytes);
      rawIndices.upload(decoded.indices.data(), indexBytes);
      glFinish();
    }));
    upload16.push_back(secondsOf([&] {
      rawVertices.upload(decoded.vertices.data(), vertexBytes);
      rawIndices.upload(decoded.indices16.data(), indexBytes / 2);
      glFinish();
    }));
  }
  TERRANE_TRY(status);
  TERRANE_TRY(context.checkErrors("measuring meshes"));
  if (!holds(vertices, decoded.vertices) || !holds(indices, decoded.indices))
    return makeError("{} expands meshes into something else than the CPU", context.rendererName());
  return ExpandingTimes{medianOf(cpu), medianOf(gpu), medianOf(upload), medianOf(upload16)};
}

}  // namespace terrane
