#pragma once

#include <array>
#include <memory>
#include <vector>

#include "imagery_input.h"
#include "terrane/bake/imagery.h"
#include "terrane/base/result.h"
#include "terrane/codec/imagery_codec.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

/// Where a picture lies in the dataset's CRS, edges included.
struct PlacedPicture {
  PictureInput input;
  bool aligned = false;  ///< in the dataset's CRS and not turned: columns and rows run along its axes
  double west = 0.0;
  double east = 0.0;
  double south = 0.0;
  double north = 0.0;
  double spacing = 1.0;  ///< of its pixels, CRS units
};

/// Brings one picture onto the texels of one level, tile by tile, for one thread. The kernel is cubic
/// (Catmull-Rom) on colours multiplied by alpha, as wide as four pixels or four texels, whichever is more.
/// Every texel is a function of its place alone.
class PictureSampler {
 public:
  /// Both arguments must outlive the sampler.
  static Result<std::unique_ptr<PictureSampler>> open(const PlacedPicture& picture, const ImageryFrame& frame,
                                                      int level);
  ~PictureSampler();
  PictureSampler(const PictureSampler&) = delete;
  PictureSampler& operator=(const PictureSampler&) = delete;

  /// The picture on the tile, transparent where it is not.
  Status read(TileId id, ImageryTile& out);

 private:
  /// A square of texels of the tile.
  struct Block {
    int x0, y0, side;
  };
  /// The pixels that a block needs.
  struct Window {
    int col, row, cols, rows;
  };
  /// Which pixels make a texel, along one axis.
  struct Taps {
    int count = 0;
    std::vector<int> first;      ///< of each texel, counted in the window; may reach beyond it
    std::vector<float> weights;  ///< count a texel
  };

  PictureSampler(const PlacedPicture& picture, const ImageryFrame& frame, int level);
  double eastingOf(int64_t texel2) const;   ///< of half texels from the world's west edge
  double northingOf(int64_t texel2) const;  ///< of half texels from the world's north edge
  Status readAligned(TileId id, ImageryTile& out);
  Result<bool> readWarped(TileId id, Block block, ImageryTile& out);
  Status readWindow(const Window& window);
  static Taps makeTaps(const std::vector<double>& centers, double scale, int origin);

  const PlacedPicture& picture_;
  const ImageryFrame& frame_;
  double texelX_;
  double texelY_;
  std::optional<PictureReader> reader_;
  void* transformer_ = nullptr;
  std::vector<uint8_t> rgba_;
  std::vector<float> pixels_;  ///< the window: red, green, blue times alpha, alpha; 0 to 255
  std::vector<float> lines_;   ///< the window's rows on the tile's columns
};

}  // namespace terrane
