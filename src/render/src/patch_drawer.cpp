#include "patch_drawer.h"

#include <vector>

#include "terrane/tiling/patch_template.h"

namespace terrane {

void PatchDrawer::makeTemplates(const PatchGrid& grid) {
  const std::array<PatchTemplate, 2> sources = {makeRightAngleTemplate(grid), makeHypotenuseTemplate(grid)};
  for (size_t i = 0; i < 2; ++i) {
    Template& target = templates_[i];
    std::vector<int16_t> vertices;
    for (const LatticePoint& p : sources[i].vertices) {
      vertices.push_back(static_cast<int16_t>(p.x));
      vertices.push_back(static_cast<int16_t>(p.y));
    }
    target.vertexCount = static_cast<int32_t>(sources[i].vertices.size());
    target.indexCount = static_cast<int32_t>(sources[i].indices.size());
    target.vertices.upload(vertices.data(), vertices.size() * sizeof(int16_t));
    target.vertexArray.setAttribute(target.vertices,
                                    {.location = 0, .components = 2, .type = GL_SHORT, .strideBytes = 4});
    target.vertexArray.setIndices(target.indices);
    target.indices.upload(sources[i].indices.data(), sources[i].indices.size() * sizeof(uint16_t));
    for (GLuint location = 1; location <= 5; ++location)
      target.vertexArray.setAttribute(target.instances,
                                      {.location = location,
                                       .components = 4,
                                       .type = static_cast<GLenum>(location == 3 ? GL_FLOAT : GL_INT),
                                       .offsetBytes = 16 * (location - 1),
                                       .strideBytes = sizeof(PatchInstance),
                                       .divisor = 1});
  }
  glBindVertexArray(0);
  k_ = grid.k;
}

void PatchDrawer::setInstances(const PatchGrid& grid, const PatchInstances& instances) {
  if (k_ != grid.k) makeTemplates(grid);
  for (size_t i = 0; i < 2; ++i) {
    const auto& source = instances.byTemplate[i];
    templates_[i].instances.upload(source.data(), source.size() * sizeof(PatchInstance));
    templates_[i].instanceCount = static_cast<int32_t>(source.size());
  }
}

int PatchDrawer::draw(const gpu::Program& program) const {
  int calls = 0;
  for (int which = 0; which < 2; ++which) {
    const Template& source = templates_[static_cast<size_t>(which)];
    if (source.instanceCount == 0) continue;
    program.setInt("uTemplate", which);
    source.vertexArray.bind();
    glDrawElementsInstanced(GL_TRIANGLES, source.indexCount, GL_UNSIGNED_SHORT, nullptr,
                            source.instanceCount);
    ++calls;
  }
  glBindVertexArray(0);
  return calls;
}

int64_t PatchDrawer::drawPoints(int which) const {
  const Template& source = templates_[static_cast<size_t>(which)];
  if (source.instanceCount == 0) return 0;
  source.vertexArray.bind();
  glDrawArraysInstanced(GL_POINTS, 0, source.vertexCount, source.instanceCount);
  glBindVertexArray(0);
  return static_cast<int64_t>(source.vertexCount) * source.instanceCount;
}

}  // namespace terrane
