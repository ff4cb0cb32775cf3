#include "terrane/lod/select_patches.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "diamond_wishes.h"
#include "judgement.h"
#include "known_tiles.h"
#include "leave_out_hidden.h"
#include "morph_ramps.h"
#include "patch_ground.h"
#include "pieces.h"
#include "selection_context.h"
#include "split.h"
#include "split_morph.h"
#include "terrane/base/check.h"
#include "wish_list.h"

namespace terrane {

namespace {

/// One selection under way: the sets that the traversal builds.
class Selector {
 public:
  Selector(const PatchSelection& selection, const Frame& frame, const ElevationScale& scale,
           const Camera& camera, const ResidentTiles& tiles, MorphHistory* history, double elapsedSeconds)
      : context_{selection, frame, scale, camera, tiles},
        tiles_(context_),
        ramps_(context_.morphs ? history : nullptr, context_.lattice.depth(),
               context_.isMeshes ? -1 : context_.grid.k, elapsedSeconds),
        wishes_(context_) {}

  Cut run() {
    cut_.latticeDepth = context_.lattice.depth();
    cut_.surface = context_.selection.surface;
    cut_.grid = context_.grid;
    KnownTile& root = tiles_.root();
    if (wishes_.wishForRoot(root)) {
      // Level by level: a diamond is looked at when every parent that it has in the world has split.
      for (const Triangle& t : context_.lattice.rootTriangles())
        next_.add({t, -1, groundOf(context_, tiles_, t, {&root, &root, {}})});
      while (!next_.isEmpty()) splitOneLevel();
    }
    wishes_.finish(cut_);
    cut_.ramping = ramps_.finish();
    if (context_.isMeshes && context_.selection.cull && context_.selection.hide)
      leaveOutHidden(cut_, context_.selection, context_.camera, context_.cellMeters, context_.resident);
    return std::move(cut_);
  }

 private:
  /// Splits the diamonds of one level that want and may; draws the triangles of the others. Leaves the
  /// triangles one level deeper.
  void splitOneLevel() {
    std::swap(level_, next_);
    next_.clear();
    for (Pieces pieces = level_.take(); pieces.count > 0; pieces = level_.take()) look(pieces);
  }

  void look(const Pieces& pieces) {
    const Diamond d = pieces.diamond();
    const Judgement judged = judge(context_, tiles_, pieces);
    if (judged.wantsSplit && d.level < context_.deepestLevel && trySplit(d, judged, pieces)) return;
    if (judged.sight == ScreenMetric::Sight::None) return;
    if (judged.sight == ScreenMetric::Sight::Part && !context_.metric.visible(judged.own)) return;
    const ScreenMetric::Depth depth = context_.metric.depth(judged.own);
    for (const Piece* piece : pieces) draw(*piece, judged, depth);
  }

  bool trySplit(const Diamond& d, const Judgement& judged, const Pieces& pieces) {
    // Both triangles of the diamond exist exactly when both parents have split.
    if (pieces.count != context_.lattice.apexes(d).count || (context_.isMeshes && !areWhole(pieces)))
      return false;
    const MorphRamps::Progress parents = parentsRamp(pieces);
    const SplitChildren children = childrenOf(context_, tiles_, pieces);
    if (!maySplit(d, judged, parents, children)) return false;
    Split made;
    made.startMeters = startErrorMeters(context_, judged, children);
    const double wanted = morphOf(context_, tiles_, d, judged, made.startMeters, children);
    made.ramp = ramps_.advance(d, parents, wanted, judged.excess());
    made.morph = static_cast<float>(std::min(wanted, made.ramp.share));
    made.errorMeters = judged.errorMeters;
    made.errorPixels = judged.errorPixels;
    const auto index = static_cast<int>(splits_.size());
    splits_.push_back(made);
    for (const SplitChild& child : children) next_.add({child.triangle, index, child.ground});
    return true;
  }

  /// Null where nothing made it.
  const Split* splitOf(const Piece& piece) const {
    return piece.split >= 0 ? &splits_[static_cast<size_t>(piece.split)] : nullptr;
  }
  /// Do the patches show themselves, and nothing of their parents any more? Strict saturation sees to that,
  /// where errors are codes.
  bool areWhole(const Pieces& pieces) const {
    return std::all_of(pieces.begin(), pieces.end(), [&](const Piece* piece) {
      const Split* made = splitOf(*piece);
      return made == nullptr || made->morph >= 1.0F;
    });
  }
  /// How far the splits that made a diamond's triangles have faded in.
  MorphRamps::Progress parentsRamp(const Pieces& pieces) const {
    MorphRamps::Progress out;
    for (const Piece* piece : pieces)
      if (const Split* made = splitOf(*piece)) out = MorphRamps::Progress::both(out, made->ramp);
    return out;
  }
  /// May a diamond that wants to split do so: are its children's tiles here, and its parents there in full?
  bool maySplit(const Diamond& d, const Judgement& judged, const MorphRamps::Progress& parents,
                const SplitChildren& children) {
    const Residency residency = wishes_.wishForChildren(d, judged, children);
    if (residency == Residency::Missing) ramps_.holdBack(d);
    return residency == Residency::Resident && parents.done();
  }

  void draw(const Piece& piece, const Judgement& judged, const ScreenMetric::Depth& depth) {
    Patch patch;
    patch.triangle = piece.triangle;
    patch.errorPixels = static_cast<float>(judged.errorPixels);
    if (const Split* made = splitOf(piece)) {
      patch.morph = made->morph;
      if (made->morph < 1.0F)
        patch.errorPixels = static_cast<float>(made->mixedErrorPixels(judged.errorMeters));
    }
    KnownTile* tile = piece.ground.tile;
    if (context_.isMeshes) {
      const MeshPlace& place = piece.ground.mesh;
      tile = place.tile;
      patch.mesh = place.at;
      patch.triangles = place.patch != nullptr ? place.patch->indexCount / 3 : 0;
    }
    patch.tile = tile->id;
    patch.shadingTile = shadingTile(piece.triangle, *tile, judged, depth).id;
    cut_.patches.push_back(patch);
  }

  /// A patch's shading tile: as deep as one texel a pixel asks for, a tile can hold the patch, and tiles are
  /// here. Wishes for those that are not.
  const KnownTile& shadingTile(const Triangle& t, KnownTile& patchTile, const Judgement& judged,
                               const ScreenMetric::Depth& depth) {
    const double texelPixels = context_.selection.texelPixels;
    const int deepest = std::min(t.diamond.level / 2, context_.finestLevel);
    KnownTile* tile = &patchTile;
    double texel = context_.metric.lengthPixels(context_.tileSpacing(tile->id.level), depth);
    for (int level = tile->id.level; level < deepest; ++level) {
      if (texel <= texelPixels) break;
      KnownTile& finer = tiles_.childOf(*tile, context_.lattice.tileOf(t, level + 1));
      if (finer.residency == Residency::Missing) {
        const bool wantsAll = !context_.isMeshes || 0.5 * texel > kLayerTexelPixels * texelPixels;
        const MeshScale& meshes = context_.meshScale;
        const int layer =
            wantsAll ? context_.lastLayer() : meshes.layerOf(2 * (level + 1) + meshes.lastOwnLevel());
        wishes_.wishForShading(finer, layer, texel, judged);
      }
      if (finer.residency != Residency::Resident) break;
      tile = &finer;
      texel *= 0.5;
    }
    if (!context_.isWhole(*tile->tile) && texel > kLayerTexelPixels * texelPixels)
      wishes_.wishForShading(*tile, context_.lastLayer(), texel, judged);
    return *tile;
  }

  SelectionContext context_;
  KnownTiles tiles_;
  MorphRamps ramps_;
  DiamondWishes wishes_;
  PieceLevel level_, next_;  ///< the triangles of the level that is looked at, and of the next one
  std::vector<Split> splits_;
  Cut cut_;
};

}  // namespace

Cut selectPatches(const PatchSelection& selection, const Frame& frame, const ElevationScale& scale,
                  const Camera& camera, const ResidentTiles& tiles, MorphHistory* history,
                  double elapsedSeconds) {
  TERRANE_CHECK(selection.grid.k >= PatchGrid::kSmallest && selection.grid.k <= PatchGrid::kLargest, "k {}",
                selection.grid.k);
  TERRANE_CHECK(selection.tolerancePixels > 0.0, "tau {}", selection.tolerancePixels);
  TERRANE_CHECK(selection.surface == SurfaceKind::Patches || selection.metric == SplitMetric::Full,
                "meshes by another metric than the full one");
  return Selector(selection, frame, scale, camera, tiles, history, elapsedSeconds).run();
}

}  // namespace terrane
