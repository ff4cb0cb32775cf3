#include "patch_instances.h"
#include "terrane/base/bit_cast.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

namespace terrane {

namespace {

/// 2 to the power of a small integer, exactly.
double powerOfTwo(int exponent) {
  return std::ldexp(1.0, exponent);
}

/// Which of the instances, and how far from the anchor, squared.
struct Placed {
  double distance;
  size_t index;
};

}  // namespace

// The hue jumps by the golden angle.
int32_t tileColor(TileId id) {
  const auto hash = static_cast<uint32_t>(TileIdHash{}(id) >> 16);
  const double hue = std::fmod(static_cast<double>(hash & 0xffffU) * 0.6180339887498949, 1.0) * 6.0;
  const double lightness = 0.56 + 0.24 * static_cast<double>(hash >> 16 & 0xffU) / 255.0;
  const auto channel = [&](double shift) {
    const double wave = std::clamp(std::abs(std::fmod(hue + shift, 6.0) - 3.0) - 1.0, 0.0, 1.0);
    return static_cast<int32_t>(std::lround(255.0 * lightness * (0.55 + 0.45 * wave)));
  };
  return channel(0.0) | channel(4.0) << 8 | channel(2.0) << 16;
}

Result<ShadingPlace> shadingPlace(const Patch& patch, const TileStore& tiles) {
  ShadingPlace out{patch.shadingTile, tiles.find(patch.shadingTile)};
  while (out.entry == nullptr && out.tile.level > patch.tile.level) {
    out.tile = out.tile.parent();
    out.entry = tiles.find(out.tile);
  }
  if (out.entry == nullptr)
    return makeError("tile {} cannot light a patch of {}", toString(patch.shadingTile), toString(patch.tile));
  return out;
}

std::array<float, 4> shadingCells(LatticePoint origin, int32_t unit, int latticeDepth, TileId shadingTile,
                                  const Frame& frame) {
  const double scale = powerOfTwo(shadingTile.level - latticeDepth);
  return {static_cast<float>(origin.x * scale - static_cast<double>(shadingTile.col) * kTileCells),
          static_cast<float>(origin.y * scale - static_cast<double>(shadingTile.row) * kTileCells),
          static_cast<float>(unit * scale),
          static_cast<float>(powerOfTwo(shadingTile.level - frame.finestLevel))};
}

glm::dvec2 latticeSpacing(const Frame& frame, int latticeDepth) {
  const double cells = powerOfTwo(frame.finestLevel - latticeDepth);
  return {frame.spacingXMeters() * cells, frame.spacingYMeters() * cells};
}

LatticePoint anchorNear(const Lattice& lattice, const Frame& frame, glm::dvec3 pointLocal) {
  const glm::dvec2 spacing = latticeSpacing(frame, lattice.depth());
  const double least = -static_cast<double>(lattice.side());
  const double most = 2.0 * lattice.side();
  return {static_cast<int32_t>(std::clamp(std::round(pointLocal.x / spacing.x), least, most)),
          static_cast<int32_t>(std::clamp(std::round(-pointLocal.y / spacing.y), least, most))};
}

Result<PatchInstances> makePatchInstances(const Cut& cut, const Frame& frame, LatticePoint anchor,
                                          const TileStore& tiles, ImageryStore* imagery) {
  const Lattice lattice(cut.latticeDepth);
  PatchInstances out;
  std::unordered_set<TileId, TileIdHash> used;
  std::array<std::vector<PatchInstance>, 2> instances;
  std::array<std::vector<Placed>, 2> order;
  TileColors colors;
  // Patches of a tile mostly follow each other.
  TileId last{-1, 0, 0};
  const TileStore::Entry* heights = nullptr;
  for (const Patch& patch : cut.patches) {
    if (!(patch.tile == last)) {
      heights = tiles.find(patch.tile);
      if (heights == nullptr)
        return makeError("the cut draws tile {}, which was not uploaded", toString(patch.tile));
      used.insert(patch.tile);
      last = patch.tile;
    }
    TERRANE_ASSIGN(const ShadingPlace shading, shadingPlace(patch, tiles));
    if (shading.entry->coverage == Coverage::Kind::None) continue;

    const PatchPlacement place = placePatch(lattice, cut.grid, patch.triangle);
    PatchInstance instance;
    instance.lattice = {place.origin.x - anchor.x, place.origin.y - anchor.y, place.unit, place.rotation};

    // In the height tile every vertex is a sample.
    const int shift = cut.latticeDepth - patch.tile.level;
    instance.texel = {(place.origin.x >> shift) - patch.tile.col * kTileCells,
                      (place.origin.y >> shift) - patch.tile.row * kTileCells, place.unit >> shift,
                      heights->layer};

    instance.shading = shadingCells(place.origin, place.unit, cut.latticeDepth, shading.tile, frame);
    instance.layers = {shading.entry->layer, shading.entry->coverageLayer, colors.of(patch.tile),
                       bitCast<int32_t>(patch.errorPixels)};
    instance.imagery[1] = bitCast<int32_t>(patch.morph);
    if (imagery != nullptr) instance.imagery[0] = imagery->addPage(lattice, patch.triangle, shading.tile);
    const double x = instance.lattice[0], y = instance.lattice[1];
    const auto which = static_cast<size_t>(patch.triangle.diamond.level & 1);
    order[which].push_back({x * x + y * y, instances[which].size()});
    instances[which].push_back(instance);
  }
  out.tileCount = static_cast<int>(used.size());

  // Near patches first: what they hide is not shaded.
  for (size_t which = 0; which < order.size(); ++which) {
    std::sort(order[which].begin(), order[which].end(), [](const Placed& a, const Placed& b) {
      return a.distance != b.distance ? a.distance < b.distance : a.index < b.index;
    });
    out.byTemplate[which].reserve(order[which].size());
    for (const Placed& each : order[which]) out.byTemplate[which].push_back(instances[which][each.index]);
  }
  return out;
}

}  // namespace terrane
