#include "diamond_wishes.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

#include "node_code.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {

bool DiamondWishes::wishForRoot(const KnownTile& root) {
  const Tile* tile = root.tile;
  if (tile == nullptr || (!context_.isMeshes && !context_.isWhole(*tile)))
    wishForRootTile(context_.isMeshes ? 0 : context_.lastLayer());
  if (tile == nullptr) return false;
  if (!context_.isMeshes || context_.resident.findMeshes(root.id, 0) != nullptr) return true;
  const int layer = context_.meshScale.layerOf(0);
  if (layer < tile->samples.layerCount)
    meshes_.push_back({root.id, 0});
  else
    wishForRootTile(layer);
  return false;
}

void DiamondWishes::wishForRootTile(int layer) {
  tiles_.forGeometry(TileId{}, layer, {std::numeric_limits<double>::infinity(), 0.0, context_.pictureArea});
}

Residency DiamondWishes::wishForChildren(const Diamond& d, const Judgement& judged,
                                         const SplitChildren& children) {
  if (context_.isMeshes) return wishForChildMeshes(judged, children);
  if (context_.grid.tileLevel(d.level + 1) == context_.grid.tileLevel(d.level)) return Residency::Resident;
  Residency least = Residency::Resident;
  const KnownTile* wished = nullptr;
  for (const SplitChild& child : children) {
    const KnownTile* tile = child.ground.tile;
    if (tile->residency == Residency::Missing) {
      if (tile != wished) wishForTile(*tile, context_.lastLayer(), judged);
      wished = tile;
      least = Residency::Missing;
    } else if (tile->residency == Residency::Implied && least == Residency::Resident &&
               context_.selection.metric != SplitMetric::DistanceOnly) {
      // Nothing significant below: a split would show nothing new.
      least = Residency::Implied;
    }
  }
  return least;
}

/// The same for their meshes. Wishes for those that are not made.
Residency DiamondWishes::wishForChildMeshes(const Judgement& judged, const SplitChildren& children) {
  Residency least = Residency::Resident;
  const KnownTile* wished = nullptr;
  for (const SplitChild& child : children) {
    const MeshPlace& place = child.ground.mesh;
    if (place.residency == Residency::Implied) return Residency::Implied;
    if (place.patch != nullptr) continue;
    least = Residency::Missing;
    const bool isHere = place.residency == Residency::Resident;
    if (isHere && layerOf(place) < place.tile->tile->samples.layerCount) {
      const MeshWish made{place.tile->id, place.at.level};
      if (std::find(meshes_.begin(), meshes_.end(), made) == meshes_.end()) meshes_.push_back(made);
    } else if (place.tile != wished) {
      const int layer = isHere ? layerOf(place) : context_.meshScale.layerOf(child.triangle.diamond.level);
      wishForTile(*place.tile, layer, judged);
      wished = place.tile;
    }
  }
  return least;
}

/// Up to which layer of significance a mesh is made of its tile's samples.
int DiamondWishes::layerOf(const MeshPlace& place) const {
  return context_.meshScale.layerOf(place.at.level + 2 * place.tile->id.level);
}

void DiamondWishes::wishForTile(const KnownTile& tile, int layer, const Judgement& judged) {
  // What is left: what the parent knows of the tile, at most what saturation leaves; or half.
  double left = 0.5;
  const bool isNew = tile.residency == Residency::Missing;
  if (isNew && judged.excess() > 0.0 && context_.grid.k <= kNodeGrid.k &&
      tile.parent->residency == Residency::Resident && judged.errorMeters > 0.0) {
    const KnownTile& parent = *tile.parent;
    const ChildSummary& child = parent.tile->children[static_cast<size_t>(tile.id.quadrant())];
    left = std::min(
        context_.scale.errorFromCode(child.error) * context_.selection.exaggeration / judged.errorMeters,
        1.0 / kSaturation);
  }
  tiles_.forGeometry(tile.id, layer,
                     {judged.urgency, std::min(judged.urgency, context_.pictureDiagonal) * left,
                      approximateArea(judged.own)});
}

void DiamondWishes::wishForShading(const KnownTile& tile, int layer, double texelPixels,
                                   const Judgement& judged) {
  const double urgency = kShadingWishWeight * texelPixels;
  tiles_.forShading(
      tile.id, layer,
      {urgency, 0.5 * std::min(urgency, context_.pictureDiagonal), 0.5 * approximateArea(judged.own)});
}

/// About as much of the picture as shows the ground of a prism. The ground never fills the prism from its
/// lowest to its highest: the middle half stands for it.
double DiamondWishes::approximateArea(Prism prism) const {
  const double quarter = 0.25 * (prism.high - prism.low);
  prism.low += quarter;
  prism.high -= quarter;
  return context_.metric.areaPixels(prism);
}

void DiamondWishes::finish(Cut& cut) {
  cut.wishes = tiles_.sorted(context_.pictureDiagonal);
  cut.meshWishes = std::move(meshes_);
}

}  // namespace terrane
