#include "terrane/lod/select_patches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <vector>

#include "leave_out_hidden.h"
#include "morph_ramps.h"
#include "terrane/base/check.h"
#include "terrane/lod/mesh_placement.h"
#include "terrane/lod/octagon.h"
#include "terrane/lod/screen_metric.h"
#include "terrane/tiling/node_layout.h"
#include "wish_list.h"

namespace terrane {

namespace {

/// More of the aimed at sizes than this a texel of the finest shading tile that a patch can have may not
/// cover.
constexpr double kShadingTexelPixels = 1.5;
/// A diamond's error is larger than its children's by at least this factor: one step of error codes (strict
/// saturation).
constexpr double kSaturation = 1.0905077326652577;
/// Errors of meshes need not fall from level to level where it is the samples that are wrong; a morph takes
/// at least so much.
constexpr double kLeastMeshSaturation = 1.02;
/// Over at most this factor of the error on screen a diamond morphs, even where its children ask for nothing
/// yet: the error falls as in rough ground from one bintree level to the next, and what is drawn is worth it.
constexpr double kWidestMorph = 1.4142135623730951;

/// The centre of the diamond two levels up whose triangles hold both of the given one's.
void climbTwoLevels(int level, int& x, int& y) {
  const int s = kTileCells >> (level / 2 + 1);
  if (level % 2 == 0) {
    x = x / (4 * s) * (4 * s) + 2 * s;
    y = y / (4 * s) * (4 * s) + 2 * s;
    return;
  }
  // note: of the two neighbours along the hypotenuse exactly one is an edge-centre of twice the size.
  const bool horizontal = (x / s) % 2 != 0;
  int& along = horizontal ? x : y;
  const int across = horizontal ? y : x;
  const bool acrossIsOdd = (across / (2 * s)) % 2 != 0;
  const bool nextIsOdd = ((along + s) / (2 * s)) % 2 != 0;
  along += nextIsOdd != acrossIsOdd ? s : -s;
}

/// The diamond for K = 17 that stands for one of a smaller patch: two levels up for each halving of K, so
/// that its triangles hold the smaller ones and are drawn with the same samples. At most the coarsest there
/// is.
Diamond storedDiamond(const PatchGrid& grid, Diamond d) {
  for (int k = grid.k; k < kNodeGrid.k; ++k) {
    if (d.level < 2) return {kTileCells / 2, kTileCells / 2, 0};
    climbTwoLevels(d.level, d.x, d.y);
    d.level -= 2;
  }
  return d;
}

/// One selection under way: what is remembered of tiles, and the sets that the traversal builds.
class Selector {
 public:
  Selector(const PatchSelection& selection, const Frame& frame, const ElevationScale& scale,
           const Camera& camera, const ResidentTiles& tiles, MorphHistory* history, double elapsedSeconds)
      : selection_(selection),
        isMeshes_(selection.surface == SurfaceKind::Meshes),
        meshScale_(MeshScale::of(frame, scale)),
        grid_(isMeshes_ ? meshScale_.grid : selection.grid),
        scale_(scale),
        tiles_(tiles),
        finestLevel_(frame.finestLevel),
        drawnLevel_(finestLevel_ +
                    (selection.metric == SplitMetric::DistanceOnly ? selection.levelsBelowData : 0)),
        lattice_(drawnLevel_),
        deepest_(isMeshes_ ? meshScale_.deepestLevel() : grid_.deepestLevel(drawnLevel_)),
        octagons_(lattice_, deepest_),
        cellMeters_(frame.spacingXMeters() / std::ldexp(1.0, drawnLevel_ - finestLevel_),
                    frame.spacingYMeters() / std::ldexp(1.0, drawnLevel_ - finestLevel_)),
        camera_(camera),
        metric_(camera, cellMeters_, selection.tolerancePixels, selection.nearMeters),
        pixelsPerTangent_(camera.pixelsPerTangent()),
        worldDistance_(std::max(1.0, cellMeters_.x * lattice_.side())),
        pictureDiagonal_(std::hypot(camera.width, camera.height)),
        pictureArea_(static_cast<double>(camera.width) * camera.height),
        morphs_(selection.morph && selection.metric == SplitMetric::Full),
        ramps_(morphs_ ? history : nullptr, drawnLevel_, isMeshes_ ? -1 : grid_.k, elapsedSeconds) {}

  Cut run() {
    cut_.latticeDepth = lattice_.depth();
    cut_.surface = selection_.surface;
    cut_.grid = grid_;
    const Tile* rootTile = tiles_.find(TileId{});
    if (rootTile == nullptr || (!isMeshes_ && !isWhole(*rootTile)))
      wishes_.forGeometry(TileId{}, isMeshes_ ? 0 : lastLayer(),
                          {std::numeric_limits<double>::infinity(), 0.0, pictureArea_});
    if (rootTile == nullptr) {
      // Nothing can be drawn.
    } else if (isMeshes_ && tiles_.findMeshes(TileId{}, 0) == nullptr) {
      const int layer = layerOf(0);
      if (layer < rootTile->samples.layerCount)
        cut_.meshWishes.push_back({TileId{}, 0});
      else
        wishes_.forGeometry(TileId{}, layer, {std::numeric_limits<double>::infinity(), 0.0, pictureArea_});
    } else {
      // Level by level: a diamond is looked at when every parent that it has in the world has split.
      TileInfo& root = find(TileId{}, nullptr);
      size_t run = 0;
      for (const Triangle& t : lattice_.rootTriangles())
        next_[run++].push_back({t, -1, groundOf(t, {&root, &root, {}})});
      while (std::any_of(next_.begin(), next_.end(), [](const auto& of) { return !of.empty(); }))
        splitOneLevel();
    }
    cut_.wishes = wishes_.sorted(pictureDiagonal_);
    cut_.ramping = ramps_.finish();
    if (isMeshes_ && selection_.cull && selection_.hide)
      leaveOutHidden(cut_, selection_, camera_, cellMeters_, tiles_);
    return std::move(cut_);
  }

 private:
  enum class Residency : uint8_t {
    Resident,
    Implied,  ///< not stored: an ancestor's interpolation is exact there
    Missing,
  };
  /// What is remembered of a tile. They hang together as the tiles do: from one to its neighbour is a few
  /// steps, and each is looked up once.
  struct TileInfo {
    TileId id;
    TileInfo* parent = nullptr;  ///< of the root: null
    std::array<TileInfo*, 4> children{};
    Residency residency = Residency::Missing;
    TileInfo* stored = nullptr;  ///< where not Missing: the tile, or for Implied its nearest stored ancestor
    const Tile* tile = nullptr;  ///< of `stored`
    uint16_t low = 65535, high = 0;  ///< for Implied, of the ancestor's quadrant
    /// Its mesh levels, as far as they were asked for.
    std::array<std::optional<const MeshLevel*>, kDeepestVertexLevel + 1> meshes{};
  };

  /// A tile, by the way from another one.
  TileInfo& info(TileInfo& from, TileId id) {
    TileInfo* at = &from;
    while (at->id.level > id.level || !(id.ancestor(at->id.level) == at->id)) at = at->parent;
    while (at->id.level < id.level) at = &childOf(*at, id.ancestor(at->id.level + 1));
    return *at;
  }
  TileInfo& childOf(TileInfo& parent, TileId id) {
    TileInfo*& child = parent.children[static_cast<size_t>(id.quadrant())];
    if (child == nullptr) child = &find(id, &parent);
    return *child;
  }
  TileInfo& find(TileId id, TileInfo* parent) {
    TileInfo& found = infos_.emplace_back();
    found.id = id;
    found.parent = parent;
    if (const Tile* tile = tiles_.find(id); tile != nullptr && mayDraw(*tile, parent)) {
      found.residency = Residency::Resident;
      found.tile = tile;
      found.stored = &found;
    } else if (parent != nullptr && parent->residency == Residency::Implied) {
      found.residency = Residency::Implied;
      found.low = parent->low;
      found.high = parent->high;
    } else if (parent != nullptr && parent->residency == Residency::Resident) {
      const ChildSummary& child = parent->tile->children[static_cast<size_t>(id.quadrant())];
      if (child.state != ChildState::Present) {
        found.residency = Residency::Implied;
        found.low = child.low;
        found.high = child.high;
      }
    }
    if (found.residency == Residency::Implied) {
      found.tile = parent->tile;
      found.stored = parent->stored;
    }
    return found;
  }

  int lastLayer() const { return scale_.layerCount - 1; }
  bool isWhole(const Tile& tile) const { return tile.samples.layerCount == scale_.layerCount; }
  /// Patches draw all of a tile's samples, so they want all layers, of the tile and those above it, or
  /// neighbours would not meet. note: a root is better than nothing, and alone it meets with itself.
  bool mayDraw(const Tile& tile, const TileInfo* parent) const {
    if (isMeshes_ || parent == nullptr) return true;
    return isWhole(tile) && (parent->residency != Residency::Resident || isWhole(*parent->tile));
  }

  /// A patch's mesh.
  struct MeshPlace {
    Residency residency = Residency::Missing;  ///< Implied: so deep that there is nothing to be cut any more
    TileInfo* tile = nullptr;  ///< that is or would be read; where Missing, the one to wish for
    MeshPlacement at;
    const MeshLevel::Patch* patch = nullptr;  ///< null where it is not made
  };
  /// What a triangle is made of.
  struct Ground {
    TileInfo* tile = nullptr;    ///< whose samples its patch is of
    TileInfo* ranged = nullptr;  ///< whose nodes know its height range: the same, or an ancestor
    MeshPlace mesh;              ///< for SurfaceKind::Meshes
  };
  int tileLevel(int n) const {
    return isMeshes_ ? std::min(grid_.tileLevel(n), finestLevel_) : grid_.tileLevel(n);
  }
  /// Height ranges are stored for K = 17 and do not depend on K.
  int rangeLevel(int n) const { return std::min(kNodeGrid.tileLevel(n), grid_.tileLevel(n)); }
  /// A triangle's ground, near that of another one.
  Ground groundOf(const Triangle& t, const Ground& near) {
    const int n = t.diamond.level;
    Ground out;
    out.tile = &info(*near.tile, lattice_.tileOf(t, tileLevel(n)));
    out.ranged = &info(*near.ranged, lattice_.tileOf(t, rangeLevel(n)));
    if (isMeshes_) out.mesh = meshOf(t, *out.tile);
    return out;
  }

  /// A triangle, and the split that made it.
  struct Piece {
    Triangle triangle;
    int split;  ///< of splits_; -1 for the two that nothing made
    Ground ground;
    /// By it diamonds of one level are ordered: by x, then by y.
    uint64_t order() const {
      return static_cast<uint64_t>(triangle.diamond.x) << 32 | static_cast<uint32_t>(triangle.diamond.y);
    }
  };
  /// The triangles of one diamond that are there, one or two.
  struct Pieces {
    std::array<const Piece*, 2> items{};
    int count = 0;
    const Piece* const* begin() const { return items.data(); }
    const Piece* const* end() const { return items.data() + count; }
    /// In the order of their apexes.
    void add(const Piece& piece) {
      items[static_cast<size_t>(count++)] = &piece;
      if (count == 2 && items[1]->triangle.apex < items[0]->triangle.apex) std::swap(items[0], items[1]);
    }
  };
  /// What the splits of one level make, by where it lies from the middle of its diamond: as the diamonds are
  /// gone through in order, each of the runs is in order by itself.
  static constexpr size_t kRuns = 4;
  using Level = std::array<std::vector<Piece>, kRuns>;
  static size_t runOf(const Triangle& t) {
    const int x = t.diamond.x - t.apex.x, y = t.diamond.y - t.apex.y;
    if (x == 0) return y < 0 ? 1 : 2;
    return x < 0 ? (y > 0 ? 1 : 0) : (y < 0 ? 2 : 3);
  }
  /// A triangle that a split would make.
  struct Child {
    Triangle triangle;
    Ground ground;
  };
  using Children = UpToFour<Child>;
  struct Split {
    float morph = 1.0F;  ///< of the triangles that it made
    MorphRamps::Progress ramp;
    double errorMeters = 0.0;  ///< of the diamond before it
    double errorPixels = 0.0;
    double startMeters = 0.0;  ///< error of the triangles at morph 0, at least the diamond's
  };

  /// A diamond's codes, from the tiles of its triangles; on a tile border these are two, and both count.
  struct NodeCode {
    uint8_t error = 0;
    uint16_t low = 65535;
    uint16_t high = 0;
  };
  void widen(NodeCode& code, const Diamond& d, const Ground& ground) const {
    widenRange(code, d, *ground.ranged);
    if (isMeshes_ || ground.tile->residency != Residency::Resident) return;
    code.error = std::max(code.error, errorCode(d, *ground.tile));
  }
  uint8_t errorCode(const Diamond& d, const TileInfo& tile) const {
    return nodeErrorCode(grid_, tile.tile->nodes, tile.id.isRoot(), local(d, tile.id));
  }

  Diamond local(const Diamond& d, TileId id) const {
    const int shift = lattice_.depth() - id.level;
    return {(d.x >> shift) - id.col * kTileCells, (d.y >> shift) - id.row * kTileCells,
            d.level - 2 * id.level};
  }

  /// By the height range of the diamond itself, or for smaller patches of the one that stands for it.
  void widenRange(NodeCode& code, const Diamond& diamond, const TileInfo& tile) const {
    if (tile.residency != Residency::Resident) {
      code.low = std::min(code.low, tile.low);
      code.high = std::max(code.high, tile.high);
      return;
    }
    // note: the same diamond as for the error, or ranges would not nest from level to level.
    const Diamond d = storedDiamond(grid_, local(diamond, tile.id));
    const auto at = static_cast<size_t>(nodeIndex(d.level, d.x, d.y, tile.id.isRoot()));
    code.low = std::min(code.low, tile.tile->nodes.low[at]);
    code.high = std::max(code.high, tile.tile->nodes.high[at]);
  }

  MeshPlace meshOf(const Triangle& t, TileInfo& tile) const {
    if (tile.residency == Residency::Missing) return {Residency::Missing, &tile, {}, nullptr};
    // What is not stored is cut out of an ancestor's samples.
    TileInfo& stored = *tile.stored;
    const MeshPlacement at = meshPlacement(lattice_, t, stored.id);
    if (at.level > kDeepestVertexLevel) return {Residency::Implied, &stored, at, nullptr};
    MeshPlace out{Residency::Resident, &stored, at, nullptr};
    std::optional<const MeshLevel*>& meshes = stored.meshes[static_cast<size_t>(at.level)];
    if (!meshes) meshes = tiles_.findMeshes(stored.id, at.level);
    if (*meshes != nullptr) out.patch = &(*meshes)->patches[static_cast<size_t>(at.index)];
    return out;
  }
  /// Of a patch that is made: all that may be drawn are.
  static double meshError(const Ground& ground) {
    return ground.mesh.patch != nullptr ? static_cast<double>(ground.mesh.patch->errorMeters) : 0.0;
  }

  struct Judgement {
    ScreenMetric::Sight sight = ScreenMetric::Sight::None;
    bool ground = false;       ///< some of what lies on and below it is not void
    double errorMeters = 0.0;  ///< of its patches as they are
    double errorPixels = 0.0;
    bool wantsSplit = false;
    bool beyondCodes = false;  ///< its error is more than codes can tell: always worth a split
    /// How many times too large its error and its lighting's texels look; splits where one is above 1.
    double byError = 0.0;
    double byTexel = 0.0;
    double excess() const { return std::max(byError, byTexel); }
    double urgency = 0.0;  ///< for the wish list
    Prism own;             ///< over the diamond's own triangles
  };

  Judgement judge(const Diamond& d, const Pieces& pieces) {
    // A diamond's codes come from the tiles of its triangles; on a tile border these are two, and both count.
    NodeCode code;
    double meshMeters = 0.0;
    const auto add = [&](const Ground& ground) {
      widen(code, d, ground);
      if (isMeshes_) meshMeters = std::max(meshMeters, meshError(ground));
    };
    for (const Piece* piece : pieces) add(piece->ground);
    if (pieces.count < 2) {
      const Piece& only = *pieces.items[0];
      for (const LatticePoint& apex : lattice_.apexes(d))
        if (!(apex == only.triangle.apex)) add(groundOf({d, apex}, only.ground));
    }
    Judgement out;
    out.ground = code.low <= code.high;
    if (!out.ground) return out;
    out.errorMeters = (isMeshes_ ? meshMeters : scale_.errorFromCode(code.error)) * selection_.exaggeration;
    Prism prism;
    prism.center = {d.x, d.y};
    prism.octagon = octagons_.nested(d.level);
    prism.low = scale_.heightFromRangeCode(code.low) * selection_.exaggeration - out.errorMeters;
    prism.high = scale_.heightFromRangeCode(code.high) * selection_.exaggeration + out.errorMeters;
    out.own = prism;
    out.own.octagon = octagons_.own(d.level);
    out.sight = selection_.cull ? metric_.sight(prism) : ScreenMetric::Sight::Whole;
    if (out.sight == ScreenMetric::Sight::None) return out;
    const ScreenMetric::Depth depth = metric_.depth(prism);
    out.errorPixels = metric_.errorPixels(prism, out.errorMeters, depth);
    const double tau = selection_.tolerancePixels;
    switch (selection_.metric) {
      case SplitMetric::Full: {
        out.byError = out.errorPixels / tau;
        const double texel = texelPixels(d.level, depth);
        out.byTexel = texel / (kShadingTexelPixels * selection_.texelPixels);
        out.beyondCodes = code.error == 255 && out.errorPixels > 0.0;
        out.wantsSplit = out.excess() > 1.0 || out.beyondCodes;
        out.urgency = out.byError > 1.0 || out.beyondCodes ? out.errorPixels : kShadingWishWeight * texel;
        break;
      }
      case SplitMetric::DistanceOnly:
        out.urgency = metric_.lengthPixels(
                          cellMeters_.x * octagons_.own(d.level).extent / grid_.cellsPerSide(), depth) /
                      8.0;
        out.wantsSplit = out.urgency > tau;
        break;
      case SplitMetric::ErrorOnly:
        out.urgency = pixelsPerTangent_ * out.errorMeters / worldDistance_;
        out.wantsSplit = out.urgency > tau;
        break;
    }
    return out;
  }

  /// How far the patches that a diamond's split makes have become themselves, as far as the camera asks for
  /// them. By when a child splits this is 1, whichever of the two it splits for.
  double morphOf(const Diamond& d, const Judgement& judged, double startMeters, const Children& children) {
    if (!morphs_ || judged.beyondCodes) return 1.0;
    if (judged.byError >= kWidestMorph) return 1.0;
    const double byTexel = morphAt(judged.byTexel, kSaturation);
    const double start = judged.errorMeters > 0.0 ? startMeters / judged.errorMeters : 1.0;
    if (judged.byError * start <= 1.0) return byTexel;
    return std::max(byTexel,
                    morphAt(judged.byError, errorOverChildren(d, judged.errorMeters, children), start));
  }
  /// At morph 0 meshes are not quite the level before (MeshLevel::Patch::startErrorMeters).
  double startMeters(const Judgement& judged, const Children& children) const {
    double out = judged.errorMeters;
    if (!isMeshes_) return out;
    for (const Child& child : children)
      if (const MeshLevel::Patch* patch = child.ground.mesh.patch)
        out = std::max(out, static_cast<double>(patch->startErrorMeters) * selection_.exaggeration);
    return out;
  }

  /// 0 where a diamond is `excess` = 1 times too coarse, 1 at `band`, by when its children may be; linear in
  /// 1 / excess, so that of two errors mixed, e and at most e / band, exactly tau is left all the way. Where
  /// the first of them is e * `start`, it begins later than at 0.
  static double morphAt(double excess, double band, double start = 1.0) {
    return std::clamp((start - 1.0 / excess) / (start - 1.0 / band), 0.0, 1.0);
  }

  /// How many times larger a diamond's error is than that of each of its children, but at most kWidestMorph.
  /// Their tiles are here.
  double errorOverChildren(const Diamond& d, double errorMeters, const Children& children) {
    if (isMeshes_) return errorOverChildMeshes(d, errorMeters, children);
    // What stands for the code of a smaller patch may differ on two sides of a tile's border.
    if (grid_.k < kNodeGrid.k) return kSaturation;
    uint8_t code = 0;
    for (const Child& child : children)
      code = std::max(code, errorCode(child.triangle.diamond, *child.ground.tile));
    const double childMeters = scale_.errorFromCode(code) * selection_.exaggeration;
    if (childMeters * kWidestMorph <= errorMeters) return kWidestMorph;
    return std::max(kSaturation, errorMeters / childMeters);
  }
  double errorOverChildMeshes(const Diamond& d, double errorMeters, const Children& children) {
    double most = 0.0;
    for (const Child& child : children) {
      most = std::max(most, meshError(child.ground));
      // The child's other triangle, outside of the diamond.
      const Diamond& c = child.triangle.diamond;
      const LatticePoint apex{2 * c.x - d.x, 2 * c.y - d.y};
      if (lattice_.contains(apex)) most = std::max(most, meshError(groundOf({c, apex}, child.ground)));
    }
    most *= selection_.exaggeration;
    if (most * kWidestMorph <= errorMeters) return kWidestMorph;
    return std::max(kLeastMeshSaturation, errorMeters / most);
  }

  /// How large the texels of the finest shading tile that the diamond's patches can have look: a patch so
  /// large on screen that even these show must split too. Two levels of patches have the same one; with
  /// morphing the first of them counts for a little more, so that this, too, is strictly saturated.
  double texelPixels(int level, const ScreenMetric::Depth& depth) const {
    if (level / 2 >= finestLevel_) return 0.0;
    const double texel = metric_.lengthPixels(tileSpacing(level / 2), depth);
    return morphs_ && level % 2 == 0 ? kSaturation * texel : texel;
  }

  double tileSpacing(int tileLevel) const {
    return std::max(cellMeters_.x, cellMeters_.y) * std::ldexp(1.0, lattice_.depth() - tileLevel);
  }

  Children childrenOf(const Diamond& d, const Pieces& pieces) {
    Children out;
    for (const Triangle& t : lattice_.trianglesAfterSplit(d)) {
      // The half of the diamond that it lies in: on the same side of the hypotenuse as the apex.
      const Piece* within = pieces.items[0];
      for (const Piece* piece : pieces) {
        const LatticePoint& apex = piece->triangle.apex;
        const int64_t side =
            int64_t{t.diamond.x - d.x} * (apex.x - d.x) + int64_t{t.diamond.y - d.y} * (apex.y - d.y);
        if (side > 0) within = piece;
      }
      out.add({t, groundOf(t, within->ground)});
    }
    return out;
  }

  /// Are the tiles here that a diamond's children read? Wishes for those that are missing.
  Residency childTiles(const Diamond& d, const Judgement& judged, const Children& children) {
    if (isMeshes_) return childMeshes(judged, children);
    if (grid_.tileLevel(d.level + 1) == grid_.tileLevel(d.level)) return Residency::Resident;
    Residency least = Residency::Resident;
    const TileInfo* wished = nullptr;
    for (const Child& child : children) {
      const TileInfo* tile = child.ground.tile;
      if (tile->residency == Residency::Missing) {
        if (tile != wished) wish(*tile, lastLayer(), judged);
        wished = tile;
        least = Residency::Missing;
      } else if (tile->residency == Residency::Implied && least == Residency::Resident &&
                 selection_.metric != SplitMetric::DistanceOnly) {
        // Nothing significant below: a split would show nothing new.
        least = Residency::Implied;
      }
    }
    return least;
  }

  /// The same for their meshes. Wishes for those that are not made.
  Residency childMeshes(const Judgement& judged, const Children& children) {
    Residency least = Residency::Resident;
    const TileInfo* wished = nullptr;
    for (const Child& child : children) {
      const MeshPlace& place = child.ground.mesh;
      if (place.residency == Residency::Implied) return Residency::Implied;
      if (place.patch != nullptr) continue;
      least = Residency::Missing;
      const bool isHere = place.residency == Residency::Resident;
      if (isHere && layerOf(place) < place.tile->tile->samples.layerCount) {
        const MeshWish made{place.tile->id, place.at.level};
        if (std::find(cut_.meshWishes.begin(), cut_.meshWishes.end(), made) == cut_.meshWishes.end())
          cut_.meshWishes.push_back(made);
      } else if (place.tile != wished) {
        const int layer = isHere ? layerOf(place) : layerOf(child.triangle.diamond.level);
        wish(*place.tile, layer, judged);
        wished = place.tile;
      }
    }
    return least;
  }
  /// Up to which layer of significance a mesh is made of its tile's samples.
  int layerOf(const MeshPlace& place) const { return layerOf(place.at.level + 2 * place.tile->id.level); }
  int layerOf(int bintreeLevel) const { return meshScale_.layerOf(bintreeLevel); }

  void wish(const TileInfo& tile, int layer, const Judgement& judged) {
    // What is left: what the parent knows of the tile, at most what saturation leaves; or half.
    double left = 0.5;
    const bool isNew = tile.residency == Residency::Missing;
    if (isNew && judged.excess() > 0.0 && grid_.k <= kNodeGrid.k &&
        tile.parent->residency == Residency::Resident && judged.errorMeters > 0.0) {
      const TileInfo& parent = *tile.parent;
      const ChildSummary& child = parent.tile->children[static_cast<size_t>(tile.id.quadrant())];
      left = std::min(scale_.errorFromCode(child.error) * selection_.exaggeration / judged.errorMeters,
                      1.0 / kSaturation);
    }
    wishes_.forGeometry(
        tile.id, layer,
        {judged.urgency, std::min(judged.urgency, pictureDiagonal_) * left, approximateArea(judged.own)});
  }

  /// About as much of the picture as shows the ground of a prism. The ground never fills the prism from its
  /// lowest to its highest: the middle half stands for it.
  double approximateArea(Prism prism) const {
    const double quarter = 0.25 * (prism.high - prism.low);
    prism.low += quarter;
    prism.high -= quarter;
    return metric_.areaPixels(prism);
  }

  /// How far the splits that made a diamond's triangles have faded in.
  MorphRamps::Progress parentsRamp(const Pieces& pieces) const {
    MorphRamps::Progress out;
    for (const Piece* piece : pieces)
      if (piece->split >= 0)
        out = MorphRamps::Progress::both(out, splits_[static_cast<size_t>(piece->split)].ramp);
    return out;
  }

  /// May a diamond that wants to split do so: are its children's tiles here, and its parents there in full?
  bool maySplit(const Diamond& d, const Judgement& judged, const MorphRamps::Progress& parents,
                const Children& children) {
    const Residency residency = childTiles(d, judged, children);
    if (residency == Residency::Missing) ramps_.holdBack(d);
    return residency == Residency::Resident && parents.done();
  }
  /// Do the patches show themselves, and nothing of their parents any more? Strict saturation sees to that,
  /// where errors are codes.
  bool areWhole(const Pieces& pieces) const {
    return std::all_of(pieces.begin(), pieces.end(), [&](const Piece* piece) {
      return piece->split < 0 || splits_[static_cast<size_t>(piece->split)].morph >= 1.0F;
    });
  }

  /// Splits the diamonds of one level that want and may; draws the triangles of the others. Leaves the
  /// triangles one level deeper.
  void splitOneLevel() {
    std::swap(level_, next_);
    for (auto& run : next_) run.clear();
    std::array<size_t, kRuns> at{};
    for (;;) {
      // The first diamond that is left, and those of its triangles that are there.
      constexpr uint64_t kNone = UINT64_MAX;
      uint64_t first = kNone;
      for (size_t run = 0; run < kRuns; ++run)
        if (at[run] < level_[run].size()) first = std::min(first, level_[run][at[run]].order());
      if (first == kNone) return;
      Pieces pieces;
      for (size_t run = 0; run < kRuns; ++run)
        if (at[run] < level_[run].size() && level_[run][at[run]].order() == first)
          pieces.add(level_[run][at[run]++]);
      look(pieces);
    }
  }

  void look(const Pieces& pieces) {
    const Diamond d = pieces.items[0]->triangle.diamond;
    const Judgement judged = judge(d, pieces);
    if (judged.wantsSplit && d.level < deepest_ && trySplit(d, judged, pieces)) return;
    if (judged.sight == ScreenMetric::Sight::None) return;
    if (judged.sight == ScreenMetric::Sight::Part && !metric_.visible(judged.own)) return;
    const ScreenMetric::Depth depth = metric_.depth(judged.own);
    for (const Piece* piece : pieces) draw(*piece, judged, depth);
  }

  bool trySplit(const Diamond& d, const Judgement& judged, const Pieces& pieces) {
    // Both triangles of the diamond exist exactly when both parents have split.
    if (pieces.count != lattice_.apexes(d).count || (isMeshes_ && !areWhole(pieces))) return false;
    const MorphRamps::Progress parents = parentsRamp(pieces);
    const Children children = childrenOf(d, pieces);
    if (!maySplit(d, judged, parents, children)) return false;
    Split made;
    made.startMeters = startMeters(judged, children);
    const double wanted = morphOf(d, judged, made.startMeters, children);
    made.ramp = ramps_.advance(d, parents, wanted, judged.excess());
    made.morph = static_cast<float>(std::min(wanted, made.ramp.share));
    made.errorMeters = judged.errorMeters;
    made.errorPixels = judged.errorPixels;
    const auto index = static_cast<int>(splits_.size());
    splits_.push_back(made);
    for (const Child& child : children)
      next_[runOf(child.triangle)].push_back({child.triangle, index, child.ground});
    return true;
  }

  void draw(const Piece& piece, const Judgement& judged, const ScreenMetric::Depth& depth) {
    const Triangle& t = piece.triangle;
    Patch patch;
    patch.triangle = t;
    patch.errorPixels = static_cast<float>(judged.errorPixels);
    if (piece.split >= 0) {
      const Split& made = splits_[static_cast<size_t>(piece.split)];
      patch.morph = made.morph;
      if (made.morph < 1.0F) patch.errorPixels = static_cast<float>(mixedError(made, judged.errorMeters));
    }
    TileInfo* tile = piece.ground.tile;
    if (isMeshes_) {
      const MeshPlace& place = piece.ground.mesh;
      tile = place.tile;
      patch.mesh = place.at;
      patch.triangles = place.patch != nullptr ? place.patch->indexCount / 3 : 0;
    }
    patch.tile = tile->id;

    // The shading tile: as deep as one texel a pixel asks for, a tile can hold the patch, and tiles are here.
    const int deepest = std::min(t.diamond.level / 2, finestLevel_);
    double texel = metric_.lengthPixels(tileSpacing(patch.tile.level), depth);
    for (int level = patch.tile.level; level < deepest; ++level) {
      if (texel <= selection_.texelPixels) break;
      TileInfo& finer = childOf(*tile, lattice_.tileOf(t, level + 1));
      if (finer.residency == Residency::Missing) {
        const bool wantsAll = !isMeshes_ || 0.5 * texel > kLayerTexelPixels * selection_.texelPixels;
        wishForShading(finer, wantsAll ? lastLayer() : layerOf(2 * (level + 1) + meshScale_.lastOwnLevel()),
                       texel, judged);
      }
      if (finer.residency != Residency::Resident) break;
      tile = &finer;
      texel *= 0.5;
    }
    if (!isWhole(*tile->tile) && texel > kLayerTexelPixels * selection_.texelPixels)
      wishForShading(*tile, lastLayer(), texel, judged);
    patch.shadingTile = tile->id;
    cut_.patches.push_back(patch);
  }

  void wishForShading(const TileInfo& tile, int layer, double texel, const Judgement& judged) {
    const double urgency = kShadingWishWeight * texel;
    wishes_.forShading(
        tile.id, layer,
        {urgency, 0.5 * std::min(urgency, pictureDiagonal_), 0.5 * approximateArea(judged.own)});
  }

  /// A bound for a patch that is still part its parent: both errors as they look over the parent's prism, in
  /// which both surfaces lie.
  static double mixedError(const Split& parent, double errorMeters) {
    if (parent.errorMeters <= 0.0) return 0.0;
    const auto morph = static_cast<double>(parent.morph);
    const double mixed = (1.0 - morph) * parent.startMeters + morph * errorMeters;
    return parent.errorPixels * mixed / parent.errorMeters;
  }

  const PatchSelection& selection_;
  bool isMeshes_;
  MeshScale meshScale_;
  PatchGrid grid_;
  const ElevationScale& scale_;
  const ResidentTiles& tiles_;
  int finestLevel_;
  int drawnLevel_;
  Lattice lattice_;
  int deepest_;
  NestedOctagons octagons_;
  glm::dvec2 cellMeters_;
  const Camera& camera_;
  ScreenMetric metric_;
  double pixelsPerTangent_;
  double worldDistance_;
  double pictureDiagonal_;
  double pictureArea_;
  bool morphs_;
  MorphRamps ramps_;
  std::deque<TileInfo> infos_;  ///< note: they point at each other, and so may never move
  Level level_, next_;          ///< the triangles of the level that is looked at, and of the next one
  std::vector<Split> splits_;
  WishList wishes_;
  Cut cut_;
};

}  // namespace

uint8_t nodeErrorCode(const PatchGrid& grid, const TileNodes& nodes, bool isRoot, const Diamond& d) {
  if (grid.k > kNodeGrid.k)
    return nodes.largeError[static_cast<size_t>(largeNodeIndex(grid.k, d.level, d.x, d.y, isRoot))];
  // Above the coarsest diamond that stands for one nothing is known.
  if (d.level < 2 * (kNodeGrid.k - grid.k)) return 255;
  const Diamond stored = storedDiamond(grid, d);
  return nodes.error[static_cast<size_t>(nodeIndex(stored.level, stored.x, stored.y, isRoot))];
}

int64_t triangleCount(const Cut& cut) {
  if (cut.surface == SurfaceKind::Patches)
    return static_cast<int64_t>(cut.patches.size()) * cut.grid.trianglesPerPatch();
  int64_t out = 0;
  for (const Patch& patch : cut.patches) out += patch.triangles;
  return out;
}

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
