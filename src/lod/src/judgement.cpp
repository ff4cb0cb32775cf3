#include "judgement.h"

#include <algorithm>

#include "node_code.h"
#include "patch_ground.h"
#include "wish_list.h"

namespace terrane {

namespace {

/// More of the aimed at sizes than this a texel of the finest shading tile that a patch can have may not
/// cover.
constexpr double kShadingTexelPixels = 1.5;

/// How large the texels of the finest shading tile that the diamond's patches can have look: a patch so
/// large on screen that even these show must split too. Two levels of patches have the same one; with
/// morphing the first of them counts for a little more, so that this, too, is strictly saturated.
double texelPixels(const SelectionContext& context, int level, const ScreenMetric::Depth& depth) {
  if (level / 2 >= context.finestLevel) return 0.0;
  const double texel = context.metric.lengthPixels(context.tileSpacing(level / 2), depth);
  return context.morphs && level % 2 == 0 ? kSaturation * texel : texel;
}

}  // namespace

Judgement judge(const SelectionContext& context, KnownTiles& tiles, const Pieces& pieces) {
  const PatchSelection& selection = context.selection;
  const ScreenMetric& metric = context.metric;
  const Diamond d = pieces.diamond();

  // A diamond's codes come from the tiles of its triangles; on a tile border these are two, and both count.
  NodeCode code;
  double meshMeters = 0.0;
  const auto add = [&](const PatchGround& ground) {
    code.widen(context, d, ground);
    if (context.isMeshes) meshMeters = std::max(meshMeters, ground.meshErrorMeters());
  };
  for (const Piece* piece : pieces) add(piece->ground);
  if (pieces.count < 2) {
    const Piece& only = *pieces.items[0];
    for (const LatticePoint& apex : context.lattice.apexes(d))
      if (!(apex == only.triangle.apex)) add(groundOf(context, tiles, {d, apex}, only.ground));
  }

  Judgement out;
  if (!code.isGround()) return out;
  out.errorMeters =
      (context.isMeshes ? meshMeters : context.scale.errorFromCode(code.error)) * selection.exaggeration;
  Prism prism;
  prism.center = {d.x, d.y};
  prism.octagon = context.octagons.nested(d.level);
  prism.low = context.scale.heightFromRangeCode(code.low) * selection.exaggeration - out.errorMeters;
  prism.high = context.scale.heightFromRangeCode(code.high) * selection.exaggeration + out.errorMeters;
  out.own = prism;
  out.own.octagon = context.octagons.own(d.level);
  out.sight = selection.cull ? metric.sight(prism) : ScreenMetric::Sight::Whole;
  if (out.sight == ScreenMetric::Sight::None) return out;

  const ScreenMetric::Depth depth = metric.depth(prism);
  out.errorPixels = metric.errorPixels(prism, out.errorMeters, depth);
  const double tau = selection.tolerancePixels;
  switch (selection.metric) {
    case SplitMetric::Full: {
      out.byError = out.errorPixels / tau;
      const double texel = texelPixels(context, d.level, depth);
      out.byTexel = texel / (kShadingTexelPixels * selection.texelPixels);
      out.beyondCodes = code.error == 255 && out.errorPixels > 0.0;
      out.wantsSplit = out.excess() > 1.0 || out.beyondCodes;
      out.urgency = out.byError > 1.0 || out.beyondCodes ? out.errorPixels : kShadingWishWeight * texel;
      break;
    }
    case SplitMetric::DistanceOnly:
      out.urgency = metric.lengthPixels(context.cellMeters.x * context.octagons.own(d.level).extent /
                                            context.grid.cellsPerSide(),
                                        depth) /
                    8.0;
      out.wantsSplit = out.urgency > tau;
      break;
    case SplitMetric::ErrorOnly:
      out.urgency = context.pixelsPerTangent * out.errorMeters / context.worldDistance;
      out.wantsSplit = out.urgency > tau;
      break;
  }
  return out;
}

}  // namespace terrane
