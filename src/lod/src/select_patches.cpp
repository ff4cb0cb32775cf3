#include "terrane/lod/select_patches.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <vector>

#include "terrane/base/check.h"
#include "terrane/lod/octagon.h"
#include "terrane/lod/screen_metric.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {

namespace {

/// More pixels than this a texel of the finest shading tile that a patch can have may not cover.
constexpr double kShadingTexelPixels = 1.5;
/// A tile that only shading waits for is worth this much of one that geometry waits for.
constexpr double kShadingWishWeight = 0.25;

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
           const Camera& camera, const ResidentTiles& tiles)
      : selection_(selection),
        scale_(scale),
        tiles_(tiles),
        finestLevel_(frame.finestLevel),
        drawnLevel_(finestLevel_ +
                    (selection.metric == SplitMetric::DistanceOnly ? selection.levelsBelowData : 0)),
        lattice_(drawnLevel_),
        deepest_(selection.grid.deepestLevel(drawnLevel_)),
        octagons_(lattice_, deepest_),
        cellMeters_(frame.spacingXMeters() / std::ldexp(1.0, drawnLevel_ - finestLevel_),
                    frame.spacingYMeters() / std::ldexp(1.0, drawnLevel_ - finestLevel_)),
        metric_(camera, cellMeters_, selection.tolerancePixels, selection.nearMeters),
        pixelsPerTangent_(camera.pixelsPerTangent()),
        worldDistance_(std::max(1.0, cellMeters_.x * lattice_.side())) {}

  Cut run() {
    cut_.latticeDepth = lattice_.depth();
    cut_.grid = selection_.grid;
    if (tiles_.find(TileId{}) == nullptr) {
      cut_.wishes.push_back({TileId{}, std::numeric_limits<float>::infinity()});
      return std::move(cut_);
    }
    // Level by level: a diamond is looked at when every parent that it has in the world has split.
    const auto roots = lattice_.rootTriangles();
    std::vector<Triangle> triangles(roots.begin(), roots.end());
    while (!triangles.empty()) triangles = splitOneLevel(triangles);
    finishWishes();
    return std::move(cut_);
  }

 private:
  enum class Residency : uint8_t {
    Resident,
    Implied,  ///< not stored: an ancestor's interpolation is exact there
    Missing,
  };
  struct TileInfo {
    Residency residency;
    const Tile* tile;    ///< the tile, or for Implied its nearest stored ancestor
    uint16_t low, high;  ///< for Implied, of the ancestor's quadrant
  };

  const TileInfo& info(TileId id) {
    if (const auto at = info_.find(id); at != info_.end()) return at->second;
    TileInfo found{Residency::Missing, nullptr, 65535, 0};
    if (const Tile* tile = tiles_.find(id)) {
      found = {Residency::Resident, tile, 65535, 0};
    } else if (!id.isRoot()) {
      const TileInfo& parent = info(id.parent());
      if (parent.residency == Residency::Implied) {
        found = parent;
      } else if (parent.residency == Residency::Resident) {
        const ChildSummary& child = parent.tile->children[static_cast<size_t>(id.quadrant())];
        if (child.state != ChildState::Present)
          found = {Residency::Implied, parent.tile, child.low, child.high};
      }
    }
    return info_.emplace(id, found).first->second;
  }

  /// A diamond's codes, from the tiles of its triangles; on a tile border these are two, and both count.
  struct NodeCode {
    uint8_t error = 0;
    uint16_t low = 65535;
    uint16_t high = 0;
  };
  NodeCode codeOf(const Diamond& d) {
    NodeCode code;
    for (const LatticePoint& apex : lattice_.apexes(d)) {
      const Triangle t{d, apex};
      const TileId id = lattice_.tileOf(t, selection_.grid.tileLevel(d.level));
      const TileInfo& tile = info(id);
      if (tile.residency == Residency::Resident)
        code.error =
            std::max(code.error, nodeErrorCode(selection_.grid, tile.tile->nodes, id.isRoot(), local(d, id)));
      widenRange(code, t);
    }
    return code;
  }

  Diamond local(const Diamond& d, TileId id) const {
    const int shift = lattice_.depth() - id.level;
    return {(d.x >> shift) - id.col * kTileCells, (d.y >> shift) - id.row * kTileCells,
            d.level - 2 * id.level};
  }

  /// Height ranges are stored for K = 17 and do not depend on K: those of the diamond itself, or for smaller
  /// patches of the one that stands for it.
  void widenRange(NodeCode& code, const Triangle& t) {
    const int n = t.diamond.level;
    const TileId id = lattice_.tileOf(t, std::min(kNodeGrid.tileLevel(n), selection_.grid.tileLevel(n)));
    const TileInfo& tile = info(id);
    if (tile.residency != Residency::Resident) {
      code.low = std::min(code.low, tile.low);
      code.high = std::max(code.high, tile.high);
      return;
    }
    // note: the same diamond as for the error, or ranges would not nest from level to level.
    const Diamond d = storedDiamond(selection_.grid, local(t.diamond, id));
    const auto at = static_cast<size_t>(nodeIndex(d.level, d.x, d.y, id.isRoot()));
    code.low = std::min(code.low, tile.tile->nodes.low[at]);
    code.high = std::max(code.high, tile.tile->nodes.high[at]);
  }

  struct Judgement {
    bool visible = false;
    bool ground = false;     ///< some of what lies on and below it is not void
    double errorPixels = 0;  ///< of its patches as they are
    bool wantsSplit = false;
    double urgency = 0;  ///< for the wish list
  };

  Judgement judge(const Diamond& d) {
    const NodeCode code = codeOf(d);
    Judgement out;
    out.ground = code.low <= code.high;
    if (!out.ground) return out;
    const double error = scale_.errorFromCode(code.error) * selection_.exaggeration;
    Prism prism;
    prism.center = {d.x, d.y};
    prism.octagon = octagons_.nested(d.level);
    prism.low = scale_.heightFromRangeCode(code.low) * selection_.exaggeration - error;
    prism.high = scale_.heightFromRangeCode(code.high) * selection_.exaggeration + error;
    out.visible = !selection_.cull || metric_.visible(prism);
    if (!out.visible) return out;
    out.errorPixels = metric_.errorPixels(prism, error);
    const double tau = selection_.tolerancePixels;
    // Code 255 says "beyond what codes can tell": always worth a split.
    switch (selection_.metric) {
      case SplitMetric::Full:
        out.wantsSplit = out.errorPixels > tau || (code.error == 255 && out.errorPixels > 0.0);
        out.urgency = out.errorPixels;
        // A patch so large on screen that even its finest shading tile shows single texels: split it too.
        if (!out.wantsSplit && d.level / 2 < finestLevel_) {
          const double texel = metric_.lengthPixels(prism, tileSpacing(d.level / 2));
          out.wantsSplit = texel > kShadingTexelPixels;
          out.urgency = kShadingWishWeight * texel;
        }
        break;
      case SplitMetric::DistanceOnly:
        out.urgency = metric_.lengthPixels(prism, cellMeters_.x * octagons_.own(d.level).extent /
                                                      selection_.grid.cellsPerSide()) /
                      8.0;
        out.wantsSplit = out.urgency > tau;
        break;
      case SplitMetric::ErrorOnly:
        out.urgency = pixelsPerTangent_ * error / worldDistance_;
        out.wantsSplit = out.urgency > tau;
        break;
    }
    return out;
  }

  double tileSpacing(int tileLevel) const {
    return std::max(cellMeters_.x, cellMeters_.y) * std::ldexp(1.0, lattice_.depth() - tileLevel);
  }

  /// May the diamond split: is every tile that its children need here? Wishes for those that are not.
  bool childrenResident(const Diamond& d, double urgency) {
    const int childTileLevel = selection_.grid.tileLevel(d.level + 1);
    if (childTileLevel == selection_.grid.tileLevel(d.level)) return true;
    bool resident = true;
    for (const Triangle& t : lattice_.trianglesAfterSplit(d)) {
      const TileId id = lattice_.tileOf(t, childTileLevel);
      const Residency residency = info(id).residency;
      if (residency == Residency::Missing) {
        wish(id, urgency);
        resident = false;
      } else if (residency == Residency::Implied && selection_.metric != SplitMetric::DistanceOnly) {
        // Nothing significant below: a split would show nothing new.
        resident = false;
      }
    }
    return resident;
  }

  void wish(TileId id, double urgency) {
    float& value = wishes_[id];
    value = std::max(value, static_cast<float>(urgency));
  }

  /// Splits the diamonds of one level that want and may; draws the triangles of the others. Returns the
  /// triangles one level deeper.
  std::vector<Triangle> splitOneLevel(std::vector<Triangle>& triangles) {
    std::sort(triangles.begin(), triangles.end(),
              [](const Triangle& a, const Triangle& b) { return a.diamond < b.diamond; });
    std::vector<Triangle> next;
    for (size_t i = 0; i < triangles.size();) {
      const Diamond d = triangles[i].diamond;
      size_t end = i;
      while (end < triangles.size() && triangles[end].diamond == d) ++end;
      // Both triangles of the diamond exist exactly when both parents have split.
      const bool complete = static_cast<int>(end - i) == lattice_.apexes(d).count;
      const Judgement judged = judge(d);
      if (complete && judged.wantsSplit && d.level < deepest_ && childrenResident(d, judged.urgency)) {
        for (const Triangle& t : lattice_.trianglesAfterSplit(d)) next.push_back(t);
      } else if (judged.ground && judged.visible) {
        for (; i < end; ++i) draw(triangles[i], judged);
      }
      i = end;
    }
    return next;
  }

  void draw(const Triangle& t, const Judgement& judged) {
    Patch patch;
    patch.triangle = t;
    patch.errorPixels = static_cast<float>(judged.errorPixels);
    patch.tile = lattice_.tileOf(t, selection_.grid.tileLevel(t.diamond.level));

    // The shading tile: as deep as one texel a pixel asks for, a tile can hold the patch, and tiles are here.
    const NodeCode code = codeOf(t.diamond);
    Prism prism;
    prism.center = {t.diamond.x, t.diamond.y};
    prism.octagon = octagons_.own(t.diamond.level);
    const double error = scale_.errorFromCode(code.error) * selection_.exaggeration;
    prism.low = scale_.heightFromRangeCode(code.low) * selection_.exaggeration - error;
    prism.high = scale_.heightFromRangeCode(code.high) * selection_.exaggeration + error;
    if (selection_.cull && !metric_.visible(prism)) return;
    patch.shadingTile = patch.tile;
    const int deepest = std::min(t.diamond.level / 2, finestLevel_);
    for (int level = patch.tile.level; level < deepest; ++level) {
      const double texel = metric_.lengthPixels(prism, tileSpacing(level));
      if (texel <= 1.0) break;
      const TileId finer = lattice_.tileOf(t, level + 1);
      const Residency residency = info(finer).residency;
      if (residency == Residency::Missing) wish(finer, kShadingWishWeight * texel);
      if (residency != Residency::Resident) break;
      patch.shadingTile = finer;
    }
    cut_.patches.push_back(patch);
  }

  void finishWishes() {
    for (const auto& [id, urgency] : wishes_) cut_.wishes.push_back({id, urgency});
    std::sort(cut_.wishes.begin(), cut_.wishes.end(), [](const TileWish& a, const TileWish& b) {
      return a.errorPixels != b.errorPixels ? a.errorPixels > b.errorPixels : a.tile < b.tile;
    });
  }

  const PatchSelection& selection_;
  const ElevationScale& scale_;
  const ResidentTiles& tiles_;
  int finestLevel_;
  int drawnLevel_;
  Lattice lattice_;
  int deepest_;
  NestedOctagons octagons_;
  glm::dvec2 cellMeters_;
  ScreenMetric metric_;
  double pixelsPerTangent_;
  double worldDistance_;
  std::unordered_map<TileId, TileInfo, TileIdHash> info_;
  std::unordered_map<TileId, float, TileIdHash> wishes_;
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

Cut selectPatches(const PatchSelection& selection, const Frame& frame, const ElevationScale& scale,
                  const Camera& camera, const ResidentTiles& tiles) {
  TERRANE_CHECK(selection.grid.k >= PatchGrid::kSmallest && selection.grid.k <= PatchGrid::kLargest, "k {}",
                selection.grid.k);
  TERRANE_CHECK(selection.tolerancePixels > 0.0, "tau {}", selection.tolerancePixels);
  return Selector(selection, frame, scale, camera, tiles).run();
}

}  // namespace terrane
