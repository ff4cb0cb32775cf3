#pragma once

#include <glm/vec2.hpp>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "terrane/lod/select_patches.h"
#include "terrane/measure/mesh_triangles.h"
#include "terrane/tiling/frame.h"

namespace terrane {

/// The surface that a cut of patches or meshes shows, as a function of the place: what shaders draw, morphs
/// included, told in double precision on the CPU. Const calls may come from any thread.
class DrawnSurface {
 public:
  /// `tiles`: those of the cut's patches must be resident, and their meshes made, for as long as this lives.
  DrawnSurface(const Cut& cut, const Frame& frame, const ResidentTiles& tiles);

  /// The drawn height in metres at a local place, not exaggerated; nothing where no patch of the cut lies.
  std::optional<double> heightAt(glm::dvec2 local) const;

 private:
  struct DrawnPatch {
    float morph = 1.0F;
    // Of a cut of patches:
    PatchPlacement place;
    bool rightAngle = true;
    const float* heights = nullptr;  ///< of its tile
    LatticePoint texel;              ///< of the template's origin
    int texelUnit = 1;
    // Of a cut of meshes:
    std::optional<MeshTriangles> mesh;
    glm::dvec2 tileOrigin{0.0};  ///< in lattice cells
    double cellsASample = 1.0;
  };
  void placeTemplate(const Patch& patch, const PatchGrid& grid, const Tile& tile, DrawnPatch& drawn) const;
  void placeMesh(const Patch& patch, const ResidentTiles& tiles, DrawnPatch& drawn) const;
  const DrawnPatch* patchAt(glm::dvec2 cell) const;
  double heightIn(const DrawnPatch& patch, glm::dvec2 cell) const;
  float sample(const DrawnPatch& patch, LatticePoint vertex) const;
  float vertexHeight(const DrawnPatch& patch, LatticePoint grid) const;

  Lattice lattice_;
  int cells_;              ///< along a patch's side
  int coarsestLevel_ = 0;  ///< of the patches
  int finestLevel_ = 0;
  glm::dvec2 cellsPerMeter_;
  std::vector<DrawnPatch> patches_;
  /// The one or two drawn triangles of a diamond, by their apexes.
  struct Halves {
    std::pair<LatticePoint, const DrawnPatch*> half[2] = {};
    int count = 0;
  };
  std::unordered_map<Diamond, Halves, DiamondHash> byDiamond_;
};

}  // namespace terrane
