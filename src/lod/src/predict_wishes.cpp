#include "terrane/lod/predict_wishes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <unordered_map>

#include "terrane/codec/mesh_level.h"
#include "terrane/lod/screen_metric.h"
#include "wish_list.h"

namespace terrane {

namespace {

/// A tile that may be wished next, or a wished one that others are looked for below.
struct Guess {
  TileId tile;
  int layer = 0;              ///< up to which it will be wished
  double errorPixels = 0.0;   ///< of the patches that wait for it
  double errorMeters = 0.0;   ///< of patches that read it; infinite where nothing is known
  double statedMeters = 0.0;  ///< by the meshes that wait for it, not exaggerated
  double lowMeters = 0.0;     ///< of the ground, exaggerated
  double highMeters = 0.0;
  double urgencyPixels = 0.0;  ///< like a wish's error: that, or what large texels are worth
};

/// Most urgent first; a tile before its descendants, which are less so.
struct LessUrgent {
  bool operator()(const Guess& a, const Guess& b) const {
    return a.urgencyPixels != b.urgencyPixels ? a.urgencyPixels < b.urgencyPixels : b.tile < a.tile;
  }
};

class Predictor {
 public:
  Predictor(const PatchSelection& selection, const Frame& frame, const ElevationScale& scale,
            const Camera& camera, const ResidentTiles& tiles, const std::function<bool(TileId)>& isStored)
      : selection_(selection),
        frame_(frame),
        scale_(scale),
        tiles_(tiles),
        isStored_(isStored),
        pictureDiagonal_(std::hypot(camera.width, camera.height)),
        cellMeters_(frame.spacingXMeters(), frame.spacingYMeters()),
        metric_(camera, cellMeters_, selection.tolerancePixels, selection.nearMeters),
        meshScale_(MeshScale::of(frame, scale)) {}

  std::vector<TileWish> run(std::span<const TileWish> wishes, size_t most) {
    for (const TileWish& wish : wishes) isNew(wish.tile, wish.layer);
    for (const TileWish& wish : wishes) guessBelow(whatIsKnown(wish));
    // Where meshes are still to be made, or to fade in, nothing is wished for yet. But as no mesh states less
    // than its level's bound, which of all tiles will be wished for is known well enough without them.
    if (selection_.surface == SurfaceKind::Meshes && tiles_.find(TileId{}) != nullptr) guessBelow(Guess{});
    std::vector<TileWish> out;
    while (!open_.empty() && out.size() < most) {
      const Guess guess = open_.top();
      open_.pop();
      const double urgency = std::min(guess.urgencyPixels, pictureDiagonal_);
      out.push_back({guess.tile, guess.layer, static_cast<float>(urgency), static_cast<float>(0.5 * urgency),
                     static_cast<float>(std::max(1.0, metric_.areaPixels(prismOf(guess))))});
      guessBelow(guess);
    }
    return out;
  }

 private:
  Guess whatIsKnown(const TileWish& wish) const {
    Guess out;
    out.tile = wish.tile;
    out.errorPixels = static_cast<double>(wish.errorPixels);
    out.errorMeters = std::numeric_limits<double>::infinity();
    ChildSummary known;
    known.low = 0;
    known.high = std::numeric_limits<uint16_t>::max();
    if (const Tile* parent = wish.tile.isRoot() ? nullptr : tiles_.find(wish.tile.parent())) {
      known = parent->children[static_cast<size_t>(wish.tile.quadrant())];
      out.errorMeters = scale_.errorFromCode(known.error) * selection_.exaggeration;
    }
    out.lowMeters = scale_.heightFromRangeCode(known.low) * selection_.exaggeration;
    out.highMeters = scale_.heightFromRangeCode(known.high) * selection_.exaggeration;
    return out;
  }
  bool setHeights(Guess& guess, const ChildSummary& known) const {
    guess.lowMeters = scale_.heightFromRangeCode(known.low) * selection_.exaggeration;
    guess.highMeters = scale_.heightFromRangeCode(known.high) * selection_.exaggeration;
    return known.low <= known.high;
  }

  void guessBelow(const Guess& above) {
    if (above.tile.level >= frame_.finestLevel || above.lowMeters > above.highMeters) return;
    const Tile* tile = tiles_.find(above.tile);
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      Guess guess = above;
      guess.tile = above.tile.child(quadrant);
      if (selection_.surface == SurfaceKind::Meshes) {
        const int last = meshScale_.lastOwnLevel();
        guess.statedMeters =
            tile != nullptr
                ? statedErrorOver(quadrant, above.tile, *tile, last, meshScale_, scale_)
                : std::max(0.5 * above.statedMeters, meshScale_.boundMeters(last + 2 * above.tile.level));
      }
      if (tile != nullptr && !setHeights(guess, tile->children[static_cast<size_t>(quadrant)])) continue;
      if (!look(guess) || !isStored_(guess.tile) || !isNew(guess.tile, guess.layer)) continue;
      const Tile* here = tiles_.find(guess.tile);
      if (here == nullptr || here->samples.layerCount <= guess.layer)
        open_.push(guess);
      else if (selection_.surface == SurfaceKind::Meshes)
        guessBelow(guess);
    }
  }

  /// Was a tile not named yet, or not with so many layers? From now on it is.
  bool isNew(TileId id, int layer) {
    const auto [at, inserted] = named_.insert({id, layer});
    if (!inserted && at->second >= layer) return false;
    at->second = layer;
    return true;
  }

  /// The layers that a tile's meshes will be made of, so near that a metre of error looks so large.
  int layerWanted(TileId id, double pixelsPerMeter) const {
    if (selection_.surface == SurfaceKind::Patches) return scale_.layerCount - 1;
    int level = 2 * id.level + meshScale_.firstLevel(id.isRoot());
    const int last = id.level == meshScale_.finestLevel ? meshScale_.deepestLevel()
                                                        : 2 * id.level + meshScale_.lastOwnLevel();
    while (level < last && meshScale_.leastStatedMeters(level) * pixelsPerMeter > selection_.tolerancePixels)
      ++level;
    return meshScale_.layerOf(level);
  }

  Prism prismOf(const Guess& guess) const {
    const double half = 0.5 * std::ldexp(kTileCells, frame_.finestLevel - guess.tile.level);
    Prism prism;
    prism.center = {(2 * guess.tile.col + 1) * half, (2 * guess.tile.row + 1) * half};
    prism.octagon = {half, 2.0 * half};
    prism.low = guess.lowMeters;
    prism.high = guess.highMeters;
    return prism;
  }

  /// Makes of what is known above a tile what is guessed of it. Is it in view and worth asking for?
  bool look(Guess& guess) const {
    const Prism prism = prismOf(guess);
    if (!metric_.visible(prism)) return false;
    const ScreenMetric::Depth depth = metric_.depth(prism);

    guess.errorMeters *= 0.5;
    guess.errorPixels *= 0.5;
    if (std::isfinite(guess.errorMeters))
      guess.errorPixels = std::min(guess.errorPixels, metric_.errorPixels(prism, guess.errorMeters, depth));
    // Meshes state no smaller error than their level's bound, however smooth the ground.
    if (selection_.surface == SurfaceKind::Meshes)
      guess.errorPixels = std::max(
          guess.errorPixels, metric_.errorPixels(prism, guess.statedMeters * selection_.exaggeration, depth));
    const double texel = metric_.lengthPixels(
        std::max(cellMeters_.x, cellMeters_.y) * std::ldexp(1.0, frame_.finestLevel - guess.tile.level + 1),
        depth);
    if (guess.errorPixels <= selection_.tolerancePixels && texel <= selection_.texelPixels) return false;
    guess.urgencyPixels = std::max(guess.errorPixels, kShadingWishWeight * texel);
    guess.layer = 0.5 * texel > kLayerTexelPixels * selection_.texelPixels
                      ? scale_.layerCount - 1
                      : layerWanted(guess.tile, metric_.errorPixels(prism, selection_.exaggeration, depth));
    return true;
  }

  const PatchSelection& selection_;
  const Frame& frame_;
  const ElevationScale& scale_;
  const ResidentTiles& tiles_;
  const std::function<bool(TileId)>& isStored_;
  double pictureDiagonal_;
  glm::dvec2 cellMeters_;
  ScreenMetric metric_;
  MeshScale meshScale_;
  std::unordered_map<TileId, int, TileIdHash> named_;  ///< up to which layer
  std::priority_queue<Guess, std::vector<Guess>, LessUrgent> open_;
};

}  // namespace

std::vector<TileWish> predictWishes(std::span<const TileWish> wishes, const PatchSelection& selection,
                                    const Frame& frame, const ElevationScale& scale, const Camera& camera,
                                    const ResidentTiles& tiles, const std::function<bool(TileId)>& isStored,
                                    size_t most) {
  if (selection.metric != SplitMetric::Full) return {};
  return Predictor(selection, frame, scale, camera, tiles, isStored).run(wishes, most);
}

}  // namespace terrane
