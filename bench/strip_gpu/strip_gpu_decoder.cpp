#include "strip_gpu_decoder.h"

#include <algorithm>

#include "strip_shader.h"

namespace terrane {

namespace {

/// As in strip_decode.comp.
constexpr size_t kGroupSize = 64;
/// OpenGL's own minimum for work groups in one direction.
constexpr size_t kMaxTiles = 65535;
struct GpuTile {
  uint32_t firstHeader;
  uint32_t firstWord;
  uint32_t heightBits;
  uint32_t triangleCount;
  uint32_t firstTriangle;
};
static_assert(sizeof(GpuTile) == 20);

}  // namespace

Result<StripGpuDecoder> StripGpuDecoder::create(const gpu::Context& context) {
  TERRANE_ASSIGN(gpu::ComputeProgram program,
                 gpu::ComputeProgram::create(context, "the decoder of strips", stripShaderFiles()));
  return StripGpuDecoder(std::move(program));
}

Status StripGpuDecoder::upload(const gpu::Context& context, std::span<const StripMesh> meshes) {
  tileCount_ = 0;
  mostHeaders_ = 0;
  triangleCount_ = 0;

  // One after the other, each kind of words by itself.
  std::vector<GpuTile> tiles;
  std::vector<uint32_t> headers;
  std::vector<uint32_t> entries;
  size_t triangles = 0;
  size_t mostHeaders = 0;
  const size_t room = gpu::StorageBuffer::maxBytes();
  for (const StripMesh& mesh : meshes) {
    tiles.push_back({static_cast<uint32_t>(headers.size()), static_cast<uint32_t>(entries.size()),
                     static_cast<uint32_t>(mesh.heightBits), mesh.triangleCount,
                     static_cast<uint32_t>(triangles)});
    headers.insert(headers.end(), mesh.headers.begin(), mesh.headers.end());
    entries.insert(entries.end(), mesh.entries.begin(), mesh.entries.end());
    mostHeaders = std::max(mostHeaders, mesh.headers.size());
    triangles += mesh.triangleCount;
    if (triangles * 3 * sizeof(uint32_t) > room || tiles.size() > kMaxTiles)
      return makeError("{} strip meshes take more than the {} bytes that {} has for a buffer", meshes.size(),
                       room, context.rendererName());
  }

  tiles_.upload(tiles.data(), tiles.size() * sizeof(GpuTile));
  headers_.upload(headers.data(), headers.size() * sizeof(uint32_t));
  entries_.upload(entries.data(), entries.size() * sizeof(uint32_t));
  vertices_.upload(nullptr, triangles * 3 * sizeof(uint32_t));
  TERRANE_TRY(context.checkErrors("copying strip meshes to the GPU"));
  tileCount_ = tiles.size();
  mostHeaders_ = mostHeaders;
  triangleCount_ = triangles;
  return {};
}

void StripGpuDecoder::decode() {
  tiles_.bindTo(0);
  headers_.bindTo(1);
  entries_.bindTo(2);
  vertices_.bindTo(3);
  if (tileCount_ > 0) program_.dispatch((mostHeaders_ + kGroupSize - 1) / kGroupSize, tileCount_);
}

std::vector<uint32_t> StripGpuDecoder::readVertices() const {
  std::vector<uint32_t> out(triangleCount_ * 3);
  vertices_.read(out.data(), out.size() * sizeof(uint32_t));
  return out;
}

}  // namespace terrane
