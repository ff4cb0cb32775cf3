#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/engine/tile_pool.h"
#include "terrane/lod/select_patches.h"
#include "terrane/render/ground_lines.h"
#include "terrane/render/render_style.h"
#include "terrane/tiling/overview.h"

namespace terrane {

/// How to draw a dataset without a window.
struct TerrainOptions {
  bool forceSoftware = false;  ///< Mesa's rasteriser even where there is a GPU
  bool openGlEs = false;       ///< the dialect of browsers, OpenGL ES 3.0
};

/// A picture: rows from the top, 4 bytes a pixel, red green blue alpha.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> rgba;
};

/// The ground under the middle of each pixel, rows from the top: local coordinates (metres), NaN for sky.
struct PositionPicture {
  int width = 0;
  int height = 0;
  std::vector<glm::dvec3> local;
};

/// What one frame cost.
struct FrameReport {
  int64_t patches = 0;
  int64_t triangles = 0;
  int64_t tiles = 0;  ///< different tiles that the frame reads, for heights or shading
  int drawCalls = 0;
  double errorPixels = 0.0;    ///< bound of the geometric error over all patches of the cut
  int deepestLevel = 0;        ///< of the tiles that heights are read from
  uint64_t bytesRead = 0;      ///< of the dataset, since it was opened
  uint64_t residentBytes = 0;  ///< decoded tiles in memory
  uint64_t gpuBytes = 0;       ///< tiles on the GPU
  int64_t imageryTiles = 0;    ///< that the frame may read, coarser levels included
  uint64_t imageryBytes = 0;   ///< of imagery read from the dataset, since it was opened
  double selectMilliseconds = 0.0;
  double loadMilliseconds = 0.0;  ///< reading and decoding tiles
  double drawMilliseconds = 0.0;  ///< uploading, drawing and, for a picture, reading it back
};

/// The box around a dataset's ground, in local coordinates.
GroundBox groundBoxOf(const Manifest& manifest);

/// A dataset that can be looked at: dataset, resident tiles, selection and drawing behind one door. This is
/// the engine that the command line, and later the window and the browser, stand on. One thread.
class Terrain {
 public:
  /// Opens a dataset by its directory or address (http, https); drawing starts up when something is first
  /// drawn, so that selection alone needs no GPU.
  static Result<std::unique_ptr<Terrain>> open(const std::string& directoryOrUrl,
                                               const TerrainOptions& options = {});
  static std::unique_ptr<Terrain> over(Dataset dataset, const TerrainOptions& options = {});
  ~Terrain();
  Terrain(const Terrain&) = delete;
  Terrain& operator=(const Terrain&) = delete;

  const Dataset& dataset() const;
  TilePool& tiles();
  /// The box around the ground, in local coordinates.
  GroundBox groundBox() const;

  /// The cut that the resident tiles allow; meshes that it needs are made.
  Cut select(const Camera& camera, const PatchSelection& selection);
  /// Loads what the camera's cut wishes for, most urgent first, until nothing is left to wish or `maxTiles`
  /// have been loaded; then selects.
  Result<Cut> selectAndLoad(const Camera& camera, const PatchSelection& selection,
                            size_t maxTiles = std::numeric_limits<size_t>::max());

  /// Which of the dataset's imagery layers pictures show, by their names; before this was said, all. An empty
  /// list: none. Error: there is no such layer.
  Status showImagery(const std::vector<std::string>& names);

  /// Lines on the ground and passes over it, as TerrainRenderer has them.
  Status setLines(std::span<const GroundLine> lines);
  Status setPass(const std::string& name, std::string_view fragment, glm::dvec3 originLocal);

  /// Draws a cut. `cut` may have been selected for another camera.
  Result<Picture> draw(const Cut& cut, const Camera& camera, const RenderStyle& style);
  /// Where the ground is under every pixel, single-sampled. `exaggeration` is that of the camera's world;
  /// heights come without it.
  Result<PositionPicture> drawPositions(const Cut& cut, const Camera& camera, double exaggeration = 1.0);

  /// The last frame's cost.
  const FrameReport& report() const;
  /// The GPU's or rasteriser's own name; empty before something was drawn.
  std::string rendererName() const;

 private:
  struct State;
  explicit Terrain(std::unique_ptr<State> state);
  Status startDrawing();
  Status prepareDrawing(const Cut& cut);
  Status prepareImagery(const Camera& camera, const RenderStyle& style);
  std::unique_ptr<State> state_;
};

}  // namespace terrane
