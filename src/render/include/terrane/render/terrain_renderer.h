#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/mesh_level.h"
#include "terrane/codec/tile.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/framebuffer.h"
#include "terrane/lod/cut.h"
#include "terrane/render/prepare_lines.h"
#include "terrane/render/prepare_tile.h"
#include "terrane/render/render_style.h"
#include "terrane/tiling/camera.h"
#include "terrane/tiling/frame.h"

namespace terrane {

/// What drawing one picture took.
struct DrawStatistics {
  int64_t patches = 0;
  int64_t triangles = 0;
  int tiles = 0;                     ///< different tiles that heights were read from
  int drawCalls = 0;                 ///< of the terrain, its places included where lines or passes need them
  int samples = 1;                   ///< a pixel
  std::optional<double> gpuSeconds;  ///< where the driver can tell
};

/// Draws cuts of patches, as templates or as meshes. It keeps the tiles that were handed to it on the GPU
/// until they are dropped; which those are is the caller's choice. All calls on the thread of the context,
/// which must outlive it.
class TerrainRenderer {
 public:
  /// Compiles the shaders. Fails, with the compiler's words, where the driver does not take them.
  static Result<std::unique_ptr<TerrainRenderer>> create(gpu::Context& context);
  ~TerrainRenderer();

  /// Makes room for so many tiles, and imagery tiles, at once: as long as there are no more, nothing is
  /// allocated. Fails where the GPU cannot hold them.
  Status reserve(int tiles, int imageryTiles);
  /// GPU memory of one tile's heights and mask, of its lighting, and of one imagery tile.
  static size_t geometryBytesPerTile();
  static size_t lightingBytesPerTile();
  static size_t imageryBytesPerTile();

  /// Puts a decoded tile on the GPU, replacing the one of that address; neither is needed afterwards. About
  /// 0.1 ms and 0.65 MB. Fails where the GPU is full, and then keeps what it had.
  Status uploadTile(TileId id, const Tile& tile, std::shared_ptr<const PreparedTile> prepared);
  /// The same, prepared here: two milliseconds more.
  Status uploadTile(TileId id, const Tile& tile);
  bool hasTile(TileId id) const;
  /// For cuts of SurfaceKind::Meshes: the meshes of a tile's mesh level. What of them is drawn comes to the
  /// GPU with the frame that draws it first. Forgotten with the tile.
  void addMeshes(TileId id, std::shared_ptr<const MeshLevel> meshes);
  bool hasMeshes(TileId id, int level) const;
  /// Forgets those of one level; nothing happens if they are not there.
  void dropMeshes(TileId id, int level);
  /// Forgets a tile; nothing happens if it is not there.
  void dropTile(TileId id);
  size_t tileCount() const;
  /// Bytes of GPU memory that tiles take, free layers included.
  size_t gpuBytes() const;

  /// Texels of an imagery tile with one of border around them: kImageryUploadSide squared, red, green, blue
  /// (not multiplied by alpha), alpha. No texels at all: there is no picture on that tile. Where an imagery
  /// tile is, its ancestors must be too; where it is not, its nearest ancestor is drawn.
  static constexpr int kImageryUploadSide = 258;
  Status uploadImagery(TileId id, std::span<const uint8_t> rgba);
  bool hasImagery(TileId id) const;
  /// Replaces some texels of an imagery tile that is there with a picture: its border, when a neighbour came.
  /// `rgba`: width x height of the rectangle whose first texel is (x, y) of kImageryUploadSide squared.
  void updateImagery(TileId id, int x, int y, int width, int height, std::span<const uint8_t> rgba);
  void dropImagery(TileId id);

  /// Replaces all lines that lie on the ground; later ones lie over earlier ones. They are exact to the
  /// pixel: each pixel asks which segments are near the place under it, so the ground hides what is behind
  /// it. The first call compiles the shader. While there are any, frames draw the ground a second time,
  /// unlit. Errors: the GPU cannot hold them; then there are none.
  Status setLines(std::span<const GroundLine> lines);
  /// The same, where finding out what is near took place elsewhere.
  Status setPreparedLines(const PreparedLines& lines);

  /// Adds a stage of the caller's own over the finished ground and its lines, or replaces the one of that
  /// name in its place: GLSL ES 3.00 that defines `vec3 apply(Ground ground)`, which returns linear colour
  /// (src/render/shaders/ground_pass.glsl says what a Ground is), with uniforms of its own: float, vec2,
  /// vec3, vec4. Passes run in the order of their adding. `originLocal`: what `ground.place` counts from, its
  /// height as the data has it. Error: the compiler's words, with the lines of `fragment`; then what was
  /// there before stays.
  Status setPass(const std::string& name, std::string_view fragment, glm::dvec3 originLocal);
  /// Another origin for a pass that is there.
  void movePass(const std::string& name, glm::dvec3 originLocal);
  /// Nothing happens where there is none.
  void removePass(const std::string& name);
  /// One number to four; 0 before. A uniform that the pass does not use is passed over. Errors: no such pass,
  /// another count of numbers.
  Status setPassUniform(const std::string& name, const std::string& uniform, std::span<const float> values);

  /// Draws a cut into `target`, an RGBA8 picture of the camera's size: sRGB, opaque. Every patch's tile, and
  /// its meshes, must be there; a shading tile that is not is replaced by its nearest ancestor.
  Result<DrawStatistics> draw(const Cut& cut, const Frame& frame, const Camera& camera,
                              const RenderStyle& style, const gpu::Framebuffer& target);

  /// A picture and what it took.
  struct Picture {
    std::vector<uint8_t> rgba;  ///< four bytes a pixel, row by row from the top
    DrawStatistics statistics;
  };
  /// Draws a cut into a picture of the camera's size and reads it back.
  Result<Picture> drawPicture(const Cut& cut, const Frame& frame, const Camera& camera,
                              const RenderStyle& style);

  /// The place in local coordinates under each pixel's centre, row by row from the top; NaN where there is no
  /// ground. `exaggeration` is that of the camera's world; heights are returned without it. A place lies on
  /// its pixel's ray exactly, and on the drawn surface to about 2^-23 of the distance; but where the surface
  /// folds away from the eye it may belong to the extension of a triangle that the ray misses by 1/256 pixel,
  /// since that is how exactly rasterisers know where triangles end.
  Result<std::vector<glm::dvec3>> drawPositions(const Cut& cut, const Frame& frame, const Camera& camera,
                                                double exaggeration = 1.0);

 private:
  struct Parts;
  explicit TerrainRenderer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace terrane
