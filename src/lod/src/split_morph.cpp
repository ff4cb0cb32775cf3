#include "split_morph.h"

#include <algorithm>
#include <cstdint>

#include "node_code.h"
#include "patch_ground.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {

namespace {

/// Errors of meshes need not fall from level to level where it is the samples that are wrong; a morph takes
/// at least so much.
constexpr double kLeastMeshSaturation = 1.02;
/// Over at most this factor of the error on screen a diamond morphs, even where its children ask for nothing
/// yet: the error falls as in rough ground from one bintree level to the next, and what is drawn is worth it.
constexpr double kWidestMorph = 1.4142135623730951;

/// 0 where a diamond is `excess` = 1 times too coarse, 1 at `band`, by when its children may be; linear in
/// 1 / excess, so that of two errors mixed, e and at most e / band, exactly tau is left all the way. Where
/// the first of them is e * `start`, it begins later than at 0.
double morphAt(double excess, double band, double start = 1.0) {
  return std::clamp((start - 1.0 / excess) / (start - 1.0 / band), 0.0, 1.0);
}

double errorOverChildMeshes(const SelectionContext& context, KnownTiles& tiles, const Diamond& d,
                            double errorMeters, const SplitChildren& children) {
  double most = 0.0;
  for (const SplitChild& child : children) {
    most = std::max(most, child.ground.meshErrorMeters());
    // The child's other triangle, outside of the diamond.
    const Diamond& c = child.triangle.diamond;
    const LatticePoint apex{2 * c.x - d.x, 2 * c.y - d.y};
    if (context.lattice.contains(apex))
      most = std::max(most, groundOf(context, tiles, {c, apex}, child.ground).meshErrorMeters());
  }
  most *= context.selection.exaggeration;
  if (most * kWidestMorph <= errorMeters) return kWidestMorph;
  return std::max(kLeastMeshSaturation, errorMeters / most);
}

/// How many times larger a diamond's error is than that of each of its children, but at most kWidestMorph.
/// Their tiles are here.
double errorOverChildren(const SelectionContext& context, KnownTiles& tiles, const Diamond& d,
                         double errorMeters, const SplitChildren& children) {
  if (context.isMeshes) return errorOverChildMeshes(context, tiles, d, errorMeters, children);
  // What stands for the code of a smaller patch may differ on two sides of a tile's border.
  if (context.grid.k < kNodeGrid.k) return kSaturation;
  uint8_t code = 0;
  for (const SplitChild& child : children)
    code = std::max(code, errorCode(context, child.triangle.diamond, *child.ground.tile));
  const double childMeters = context.scale.errorFromCode(code) * context.selection.exaggeration;
  if (childMeters * kWidestMorph <= errorMeters) return kWidestMorph;
  return std::max(kSaturation, errorMeters / childMeters);
}

}  // namespace

double startErrorMeters(const SelectionContext& context, const Judgement& judged,
                        const SplitChildren& children) {
  double out = judged.errorMeters;
  if (!context.isMeshes) return out;
  // At morph 0 meshes are not quite the level before (MeshLevel::Patch::startErrorMeters).
  for (const SplitChild& child : children)
    if (const MeshLevel::Patch* patch = child.ground.mesh.patch)
      out = std::max(out, static_cast<double>(patch->startErrorMeters) * context.selection.exaggeration);
  return out;
}

double morphOf(const SelectionContext& context, KnownTiles& tiles, const Diamond& d, const Judgement& judged,
               double startMeters, const SplitChildren& children) {
  if (!context.morphs || judged.beyondCodes) return 1.0;
  if (judged.byError >= kWidestMorph) return 1.0;
  const double byTexel = morphAt(judged.byTexel, kSaturation);
  const double start = judged.errorMeters > 0.0 ? startMeters / judged.errorMeters : 1.0;
  if (judged.byError * start <= 1.0) return byTexel;
  const double band = errorOverChildren(context, tiles, d, judged.errorMeters, children);
  return std::max(byTexel, morphAt(judged.byError, band, start));
}

}  // namespace terrane
