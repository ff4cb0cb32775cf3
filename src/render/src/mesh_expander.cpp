#include "mesh_expander.h"

#include <algorithm>

#include "shader_library.h"

namespace terrane {

namespace {

/// OpenGL's own minimum for work groups in one direction.
constexpr size_t kMostGroups = 65535;
/// Binding points, as in mesh_expand.comp.
enum Binding : GLuint { kJobs = 0, kCompact = 1, kVertices = 2, kIndices = 3 };

/// What a shader can see of a buffer.
size_t roomOf(GLuint buffer) {
  GLint64 bytes = 0;
  glGetNamedBufferParameteri64v(buffer, GL_BUFFER_SIZE, &bytes);
  return std::min(static_cast<size_t>(std::max<GLint64>(bytes, 0)), gpu::StorageBuffer::maxBytes());
}

}  // namespace

Result<MeshExpander> MeshExpander::create(const gpu::Context& context) {
  TERRANE_ASSIGN(gpu::ComputeProgram program,
                 gpu::ComputeProgram::create(context, "the expander of meshes",
                                             shaderFiles(std::vector<std::string_view>{"mesh_expand.comp"})));
  return MeshExpander(std::move(program));
}

Status MeshExpander::expand(const gpu::Context& context, std::span<const Job> jobs, GLuint vertexBuffer,
                            GLuint indexBuffer) {
  if (jobs.empty()) return {};
  const size_t vertexRoom = roomOf(vertexBuffer) / sizeof(PatchVertex);
  const size_t indexRoom = roomOf(indexBuffer) / sizeof(uint32_t);

  // The records of the patches, one after the other.
  jobWords_.assign(1, static_cast<uint32_t>(jobs.size()));
  compactWords_.clear();
  for (const Job& job : jobs) {
    const CompactPatch patch = compactPatch(*job.level, job.patch);
    if (size_t{job.firstVertex} + patch.vertexCount > vertexRoom ||
        size_t{job.firstIndex} + size_t{3} * patch.triangleCount > indexRoom)
      return makeError(
          "a mesh of {} vertices and {} triangles does not fit at {} and {} into {} vertices and {} indices",
          patch.vertexCount, patch.triangleCount, job.firstVertex, job.firstIndex, vertexRoom, indexRoom);
    if (job.slot >= kSlots) return makeError("there is no slot {} for meshes", job.slot);
    jobWords_.push_back(static_cast<uint32_t>(compactWords_.size()));
    jobWords_.push_back(static_cast<uint32_t>(job.level->level()));
    for (const auto& [x, y] : patch.corners)
      jobWords_.push_back(static_cast<uint32_t>(x) | static_cast<uint32_t>(y) << 9);
    jobWords_.insert(jobWords_.end(), {job.firstVertex, job.firstIndex, job.slot});
    const auto record = std::span(job.level->words).subspan(patch.firstWord, patch.wordCount);
    compactWords_.insert(compactWords_.end(), record.begin(), record.end());
  }
  const size_t room = gpu::StorageBuffer::maxBytes() / sizeof(uint32_t);
  if (std::max(compactWords_.size(), jobWords_.size()) > room)
    return makeError("{} meshes take more than the {} words that {} has for a buffer", jobs.size(), room,
                     context.rendererName());

  jobs_.upload(jobWords_.data(), jobWords_.size() * sizeof(uint32_t));
  compact_.upload(compactWords_.data(), compactWords_.size() * sizeof(uint32_t));
  jobs_.bindTo(kJobs);
  compact_.bindTo(kCompact);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kVertices, vertexBuffer);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kIndices, indexBuffer);
  program_.dispatch(std::min(jobs.size(), kMostGroups), (jobs.size() + kMostGroups - 1) / kMostGroups);
  return context.checkErrors("expanding meshes");
}

}  // namespace terrane
