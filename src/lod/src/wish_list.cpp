#include "wish_list.h"

#include <algorithm>

namespace terrane {

WishList::Sums& WishList::raise(TileId id, int layer, const Wish& wish) {
  Sums& sums = sums_[static_cast<size_t>(layer)][id];
  sums.error = std::max(sums.error, wish.error);
  sums.errorAfter = std::max(sums.errorAfter, wish.errorAfter);
  return sums;
}

std::vector<TileWish> WishList::sorted(double mostPixels) const {
  struct Ranked {
    double error;
    TileWish wish;
  };
  std::vector<Ranked> ranked;
  for (size_t layer = 0; layer < sums_.size(); ++layer) {
    for (const auto& [id, sums] : sums_[layer]) {
      // note: a diamond that waits for a tile's heights often waits for its gradients too; it counts once.
      const double area = std::max({1.0, sums.geometryArea, sums.shadingArea});
      ranked.push_back(
          {sums.error,
           {id, static_cast<int>(layer), static_cast<float>(std::min(sums.error, mostPixels)),
            static_cast<float>(std::min(sums.errorAfter, mostPixels)), static_cast<float>(area)}});
    }
  }
  std::sort(ranked.begin(), ranked.end(), [](const Ranked& a, const Ranked& b) {
    if (a.error != b.error) return a.error > b.error;
    return a.wish.tile == b.wish.tile ? a.wish.layer < b.wish.layer : a.wish.tile < b.wish.tile;
  });
  std::vector<TileWish> out;
  out.reserve(ranked.size());
  for (const Ranked& each : ranked) out.push_back(each.wish);
  return out;
}

}  // namespace terrane
