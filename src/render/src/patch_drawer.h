#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>

#include "patch_instances.h"
#include "terrane/gpu/buffer.h"
#include "terrane/gpu/program.h"
#include "terrane/gpu/vertex_array.h"

namespace terrane {

/// Draws patches: two templates, instanced, one draw call each.
class PatchDrawer {
 public:
  /// Hands the frame's instances to the GPU.
  void setInstances(const PatchGrid& grid, const PatchInstances& instances);

  /// Draws them with a program whose vertex stage is patch.vert; its block and textures are bound already.
  /// Returns the number of draw calls.
  int draw(const gpu::Program& program) const;
  /// Draws only the vertices of one template, as points, instance by instance, with the program in use: for
  /// capturing them. Returns the number of points.
  int64_t drawPoints(int which) const;

 private:
  struct Template {
    gpu::VertexArray vertexArray;
    gpu::Buffer vertices{GL_ARRAY_BUFFER};
    gpu::Buffer indices{GL_ELEMENT_ARRAY_BUFFER};
    gpu::Buffer instances{GL_ARRAY_BUFFER};
    int32_t vertexCount = 0;
    int32_t indexCount = 0;
    int32_t instanceCount = 0;
  };
  void makeTemplates(const PatchGrid& grid);

  std::optional<int> k_;
  std::array<Template, 2> templates_;
};

}  // namespace terrane
