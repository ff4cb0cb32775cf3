#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/gpu/framebuffer.h"
#include "terrane/gpu/program.h"
#include "terrane/gpu/texture.h"
#include "terrane/gpu/vertex_array.h"
#include "terrane/tiling/camera.h"

namespace terrane {

/// Callers' own stages over the finished ground, in the order in which they were added. See
/// TerrainRenderer::setPass().
class PassChain {
 public:
  explicit PassChain(gpu::Context& context) : context_(context) {}

  Status set(const std::string& name, std::string_view fragment, glm::dvec3 originLocal);
  void move(const std::string& name, glm::dvec3 originLocal);
  void remove(const std::string& name);
  Status setUniform(const std::string& name, const std::string& uniform, std::span<const float> values);
  size_t size() const { return passes_.size(); }

  /// Runs pass `index` over `from` (linear light) into `to`, another picture of the same size.
  void draw(size_t index, const gpu::Texture& from, const gpu::Texture& places, const Camera& camera,
            double exaggeration, const gpu::Framebuffer& to) const;

 private:
  struct Pass {
    std::string name;
    gpu::Program program;
    glm::dvec3 originLocal;
  };
  std::vector<Pass>::iterator find(const std::string& name);

  gpu::Context& context_;
  std::vector<Pass> passes_;
  gpu::VertexArray nothing_;
};

}  // namespace terrane
