#pragma once

#include <array>
#include <unordered_map>
#include <vector>

#include "terrane/codec/tile.h"
#include "terrane/lod/cut.h"

namespace terrane {

/// A tile that only shading waits for is worth this much of one that geometry waits for, at as many pixels a
/// texel as the other has pixels of error.
inline constexpr double kShadingWishWeight = 0.25;

/// Shading wants all layers of a tile whose texels look larger than this, in the aimed at sizes.
inline constexpr double kLayerTexelPixels = 1.0;

/// Gathers what single diamonds wish for into one wish a tile.
class WishList {
 public:
  /// What one diamond wishes, in pixels and square pixels; the error may be infinite.
  struct Wish {
    double error = 0.0;
    double errorAfter = 0.0;
    double area = 0.0;
  };
  /// A tile with its layers of significance up to `layer`.
  void forGeometry(TileId id, int layer, const Wish& wish) {
    raise(id, layer, wish).geometryArea += wish.area;
  }
  void forShading(TileId id, int layer, const Wish& wish) { raise(id, layer, wish).shadingArea += wish.area; }

  /// Most error first. `mostPixels`: no error is stated to be larger, since the picture is not.
  std::vector<TileWish> sorted(double mostPixels) const;

 private:
  struct Sums {
    double error = 0.0;
    double errorAfter = 0.0;
    double geometryArea = 0.0;
    double shadingArea = 0.0;
  };
  Sums& raise(TileId id, int layer, const Wish& wish);

  std::array<std::unordered_map<TileId, Sums, TileIdHash>, ElevationScale::kMostLayers> sums_;  ///< by layer
};

}  // namespace terrane
