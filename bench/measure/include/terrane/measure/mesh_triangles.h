#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "terrane/codec/mesh_level.h"

namespace terrane {

/// The triangles of one patch's adaptive mesh, to be found by the place: each square of a small grid over the
/// patch lists those that may touch it.
class MeshTriangles {
 public:
  /// `meshes` must stay as long as this is used; `patch` is one of its patches.
  MeshTriangles(const MeshLevel& meshes, const MeshLevel::Patch& patch);

  /// The drawn height in metres at a place in the tile's samples, with the patch's morph. A place that lies
  /// outside of the patch by roundings has the height of its nearest triangle. A few triangles are looked at.
  double heightAt(glm::dvec2 sample, float morph) const;

 private:
  glm::ivec2 squareOf(glm::dvec2 sample) const;
  std::span<const uint16_t> listAt(glm::ivec2 square) const;

  std::span<const PatchVertex> vertices_;
  std::span<const uint16_t> indices_;
  glm::dvec2 origin_{0.0};  ///< of the grid, in samples
  double squaresPerSample_ = 1.0;
  int side_ = 1;                  ///< squares along the grid's side
  std::vector<uint32_t> first_;   ///< where the list of each square begins, and after the last where it ends
  std::vector<uint16_t> listed_;  ///< triangles, by their place in the mesh's list
};

}  // namespace terrane
