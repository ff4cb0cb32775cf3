#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "imagery_store.h"
#include "mesh_store.h"
#include "terrane/base/result.h"
#include "terrane/gpu/buffer.h"
#include "terrane/gpu/program.h"
#include "terrane/gpu/texture.h"
#include "terrane/lod/cut.h"
#include "terrane/tiling/frame.h"
#include "tile_store.h"

namespace terrane {

/// What shaders know of one patch's mesh in a frame: the texels of mesh_patch.glsl.
struct MeshRecord {
  std::array<int32_t, 4>
      lattice{};  ///< the tile's origin from the anchor (x, y), cells a sample, first index
  std::array<int32_t, 4> corners{};  ///< apex and ends of the hypotenuse, x | y << 16
  std::array<int32_t, 4> shading{};  ///< float bits: the tile's origin in the shading tile (x, y), a sample
                                     ///< there, its cells in a finest data cell
  std::array<int32_t, 4> layers{};   ///< shading layer, coverage layer, colour 0xBBGGRR, error in pixels as
                                     ///< float bits
  std::array<int32_t, 4> imagery{-1, 0, 0, 0};  ///< page, morph as float bits
};
static_assert(sizeof(MeshRecord) == 80);

/// Draws cuts of adaptive meshes: all patches in one call, where the driver can.
class MeshDrawer {
 public:
  explicit MeshDrawer(gpu::Context& context);

  /// Brings a frame's meshes to the GPU, near ones first. Fails where one is not in `meshes`, or has no tile.
  Status setCut(const Cut& cut, const Frame& frame, LatticePoint anchor, const TileStore& tiles,
                ImageryStore& imagery, MeshStore& meshes);

  /// Draws with a program whose vertex stage is mesh.vert. Returns the number of draw calls.
  int draw(const gpu::Program& program, const MeshStore& meshes) const {
    return draw(program, meshes, false);
  }
  /// The same with mesh_position.frag, which looks triangles up where the dialect allows it (and
  /// then takes a draw call for each patch).
  int drawPlaces(const gpu::Program& program, const MeshStore& meshes) const;
  /// Draws the triangles' sides with the program in use, as lines; they are listed anew for each cut.
  void drawLines(const MeshStore& meshes);
  static void setSamplers(const gpu::Program& program);

  int64_t patchCount() const { return static_cast<int64_t>(counts_.size()); }
  int64_t triangleCount() const { return triangles_; }
  int tileCount() const { return tiles_; }

 private:
  int draw(const gpu::Program& program, const MeshStore& meshes, bool oneByOne) const;

  gpu::Context& context_;
  gpu::TextureArray records_;
  std::vector<MeshRecord> table_;  ///< by slot
  std::vector<GLsizei> counts_;
  std::vector<const void*> offsets_;
  std::vector<const MeshStore::Entry*> drawn_;
  int64_t triangles_ = 0;
  int tiles_ = 0;
  gpu::Buffer lines_{GL_ELEMENT_ARRAY_BUFFER};
  gpu::VertexArray lineArray_;
};

}  // namespace terrane
