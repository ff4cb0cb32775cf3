#include "split.h"

#include <cstdint>

namespace terrane {

SplitChildren childrenOf(const SelectionContext& context, KnownTiles& tiles, const Pieces& pieces) {
  const Diamond d = pieces.diamond();
  SplitChildren out;
  for (const Triangle& t : context.lattice.trianglesAfterSplit(d)) {
    // The half of the diamond that it lies in: on the same side of the hypotenuse as the apex.
    const Piece* within = pieces.items[0];
    for (const Piece* piece : pieces) {
      const LatticePoint& apex = piece->triangle.apex;
      const int64_t side =
          int64_t{t.diamond.x - d.x} * (apex.x - d.x) + int64_t{t.diamond.y - d.y} * (apex.y - d.y);
      if (side > 0) within = piece;
    }
    out.add({t, groundOf(context, tiles, t, within->ground)});
  }
  return out;
}

}  // namespace terrane
