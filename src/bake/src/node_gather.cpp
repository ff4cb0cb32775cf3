#include <algorithm>

#include "node_codes.h"

namespace terrane {

namespace {

/// Which of a parent's triangles a child's triangle is: from depth `d` in the child to depth d + 2 in the
/// parent.
struct TriangleMap {
  static constexpr int kDepths = RisingErrors::kDepths - 2;
  std::array<std::vector<size_t>, kDepths> parentTriangle;
};

LatticePoint inParent(LatticePoint inChild, int quadrant) {
  return {(quadrant & 1) * kTileCells + inChild.x, (quadrant >> 1) * kTileCells + inChild.y};
}

TriangleMap makeMap(int parity, int quadrant) {
  const TileBisection& parent = TileBisection::of({1, parity, 0});
  const TileBisection& child = TileBisection::of({1, (quadrant & 1) ^ (quadrant >> 1), 0});
  TriangleMap map;
  for (size_t depth = 0; depth < TriangleMap::kDepths; ++depth) {
    const auto& centers = parent.centers[depth + 2];
    const auto& apexes = parent.apexes[depth + 2];
    for (size_t t = 0; t < child.centers[depth].size(); ++t) {
      // In the child's cells, of which two make one of the parent's.
      const LatticePoint center = inParent(child.centers[depth][t], quadrant);
      const LatticePoint apex = inParent(child.apexes[depth][t], quadrant);
      size_t found = 0;
      while (found < centers.size() && (LatticePoint{2 * centers[found].x, 2 * centers[found].y} != center ||
                                        LatticePoint{2 * apexes[found].x, 2 * apexes[found].y} != apex))
        ++found;
      TERRANE_CHECK(found < centers.size(), "triangle {} at depth {}", t, depth);
      map.parentTriangle[depth].push_back(found);
    }
  }
  return map;
}

const TriangleMap& mapOf(TileId parent, int quadrant) {
  static const auto all = [] {
    std::array<std::array<TriangleMap, 4>, 2> maps;
    for (int parity = 0; parity < 2; ++parity) {
      for (int q = 0; q < 4; ++q)
        maps[static_cast<size_t>(parity)][static_cast<size_t>(q)] = makeMap(parity, q);
    }
    return maps;
  }();
  return all[static_cast<size_t>((parent.col + parent.row) & 1)][static_cast<size_t>(quadrant)];
}

void raise(float& value, float candidate) {
  if (candidate > value) value = candidate;
}

/// Adds what a child tells.
void addChild(TileId id, int quadrant, const RisingErrors& child, GatheredNodes& out) {
  // Two bintree levels end here, in the tile's own nodes.
  const TileBisection& bisection = TileBisection::of(id.child(quadrant));
  for (const int nodeLevel : {7, 8}) {
    const auto depth = static_cast<size_t>(nodeLevel) - 2;
    const float* errors = child.atDepth(static_cast<int>(depth));
    for (size_t t = 0; t < bisection.centers[depth].size(); ++t) {
      const LatticePoint center = inParent(bisection.centers[depth][t], quadrant);
      raise(out.error[static_cast<size_t>(nodeIndex(nodeLevel, center.x / 2, center.y / 2, id.isRoot()))],
            errors[t]);
    }
  }

  // The others rise on.
  const TriangleMap& map = mapOf(id, quadrant);
  for (int depth = 0; depth < TriangleMap::kDepths; ++depth) {
    const auto& to = map.parentTriangle[static_cast<size_t>(depth)];
    const float* errors = child.atDepth(depth);
    float* above = out.rising.atDepth(depth + 2);
    for (size_t t = 0; t < to.size(); ++t) raise(above[to[t]], errors[t]);
  }
  const auto own = static_cast<size_t>(2 * id.level);
  for (size_t half = 0; half < 2; ++half) {
    const size_t triangle = map.parentTriangle[0][half];
    raise(out.rising.atDepth(1)[triangle >> 1], child.coarse[own + 1][half]);
    raise(out.rising.atDepth(0)[triangle >> 2], child.coarse[own][half]);
    for (size_t n = 0; n < own; ++n) raise(out.rising.coarse[n][triangle >> 2], child.coarse[n][half]);
  }
}

}  // namespace

Status gatherNodes(const Pyramid& pyramid, const NodeStores& stores, const PyramidTile& tile,
                   const MeasuredNodes* measured, GatheredNodes& out) {
  out = {};
  if (measured != nullptr) {
    out.error = measured->error;
    out.rising = measured->rising;
  }
  for (int quadrant = 0; quadrant < 4; ++quadrant) {
    const int32_t child = tile.children[static_cast<size_t>(quadrant)];
    if (child < 0) continue;
    const PyramidTile& below =
        pyramid.levels[static_cast<size_t>(tile.id.level) + 1][static_cast<size_t>(child)];
    if (!below.stored) continue;
    GatheredNodes rising;
    TERRANE_TRY(stores.gathered.readValue(static_cast<uint64_t>(below.block), rising));
    addChild(tile.id, quadrant, rising.rising, out);
  }

  // In the root all ends.
  for (int nodeLevel = 0; tile.id.isRoot() && nodeLevel < RisingErrors::kDepths; ++nodeLevel) {
    const auto& centers = TileBisection::of(tile.id).centers[static_cast<size_t>(nodeLevel)];
    const float* errors = out.rising.atDepth(nodeLevel);
    for (size_t t = 0; t < centers.size(); ++t) {
      raise(out.error[static_cast<size_t>(nodeIndex(nodeLevel, centers[t].x, centers[t].y, true))],
            errors[t]);
    }
  }
  return {};
}

}  // namespace terrane
