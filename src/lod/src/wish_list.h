#pragma once

#include <unordered_map>
#include <vector>

#include "terrane/lod/cut.h"

namespace terrane {

/// A tile that only shading waits for is worth this much of one that geometry waits for, at as many pixels a
/// texel as the other has pixels of error.
inline constexpr double kShadingWishWeight = 0.25;

/// Gathers what single diamonds wish for into one wish a tile.
class WishList {
 public:
  /// What one diamond wishes, in pixels and square pixels; the error may be infinite.
  struct Wish {
    double error = 0.0;
    double errorAfter = 0.0;
    double area = 0.0;
  };
  void forGeometry(TileId id, const Wish& wish) { raise(id, wish).geometryArea += wish.area; }
  void forShading(TileId id, const Wish& wish) { raise(id, wish).shadingArea += wish.area; }

  /// Most error first. `mostPixels`: no error is stated to be larger, since the picture is not.
  std::vector<TileWish> sorted(double mostPixels) const;

 private:
  struct Sums {
    double error = 0.0;
    double errorAfter = 0.0;
    double geometryArea = 0.0;
    double shadingArea = 0.0;
  };
  Sums& raise(TileId id, const Wish& wish);

  std::unordered_map<TileId, Sums, TileIdHash> sums_;
};

}  // namespace terrane
