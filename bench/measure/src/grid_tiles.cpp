#include "terrane/measure/grid_tiles.h"

#include <algorithm>

#include "terrane/codec/all_layers.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/lod/screen_metric.h"

namespace terrane {
namespace {

constexpr int64_t kTrianglesPerTile = 2LL * kTileCells * kTileCells;
constexpr double kNearMeters = 0.1;

class GridSelection {
 public:
  GridSelection(const AllTiles& tiles, const Frame& frame, const ElevationScale& scale, const Camera& camera,
                double tauPixels)
      : tiles_(tiles),
        frame_(frame),
        scale_(scale),
        tauPixels_(tauPixels),
        metric_(camera, {frame.spacingXMeters(), frame.spacingYMeters()}, tauPixels, kNearMeters) {}

  GridTilesCost run() {
    if (const Tile* root = tiles_.find(TileId{})) visit(TileId{}, *root);
    return cost_;
  }

 private:
  void visit(TileId id, const Tile& tile) {
    const auto codes = drawnCodes(tile, id.isRoot());
    if (codes.low > codes.high) return;
    const Prism box = boxOf(id, codes.low, codes.high);
    if (!metric_.visible(box)) return;

    // Refine where the error shows, if there is anything finer.
    const bool finer = std::any_of(tile.children.begin(), tile.children.end(), [](const ChildSummary& child) {
      return child.state == ChildState::Present;
    });
    if (!finer || !(metric_.errorPixels(box, scale_.errorFromCode(codes.error)) > tauPixels_)) {
      draw(kTrianglesPerTile);
      return;
    }
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      const ChildSummary& child = tile.children[static_cast<size_t>(quadrant)];
      const TileId childId = id.child(quadrant);
      if (child.state == ChildState::Present) {
        if (const Tile* stored = tiles_.find(childId)) visit(childId, *stored);
      } else if (child.state == ChildState::Interpolated &&
                 metric_.visible(boxOf(childId, child.low, child.high))) {
        draw(kTrianglesPerTile / 4);
      }
    }
  }

  void draw(int64_t triangles) {
    ++cost_.tiles;
    cost_.triangles += triangles;
  }

  struct Codes {
    uint8_t error = 0;
    uint16_t low = 65535;
    uint16_t high = 0;
  };
  /// Over the diamonds of the last node level, whose patches are the tile's own grid.
  static Codes drawnCodes(const Tile& tile, bool isRoot) {
    Codes codes;
    const int first = nodeOffset(kNodeLevels - 1, isRoot);
    for (int i = first; i < tileNodeCount(isRoot); ++i) {
      const auto node = static_cast<size_t>(i);
      codes.error = std::max(codes.error, tile.nodes.error[node]);
      if (tile.nodes.low[node] > tile.nodes.high[node]) continue;
      codes.low = std::min(codes.low, tile.nodes.low[node]);
      codes.high = std::max(codes.high, tile.nodes.high[node]);
    }
    return codes;
  }

  /// A tile's box; a square is an octagon whose corners are not cut.
  Prism boxOf(TileId id, uint16_t low, uint16_t high) const {
    const double side =
        static_cast<double>(static_cast<int64_t>(kTileCells) << (frame_.finestLevel - id.level));
    Prism box;
    box.center = {(id.col + 0.5) * side, (id.row + 0.5) * side};
    box.octagon = {0.5 * side, side};
    box.low = scale_.heightFromRangeCode(low);
    box.high = scale_.heightFromRangeCode(high);
    return box;
  }

  const AllTiles& tiles_;
  const Frame& frame_;
  const ElevationScale& scale_;
  double tauPixels_;
  ScreenMetric metric_;
  GridTilesCost cost_;
};

}  // namespace

Result<AllTiles> AllTiles::load(const Dataset& dataset) {
  // Parents before children, whatever the archive's order is.
  std::vector<TileId> ids = dataset.elevationTiles();
  std::sort(ids.begin(), ids.end());
  AllTiles all;
  for (const TileId id : ids) {
    TERRANE_ASSIGN(const auto payloads, dataset.readAllLayers(id));
    const Tile* parent = id.isRoot() ? nullptr : all.find(id.parent());
    if (!payloads || (parent == nullptr && !id.isRoot())) {
      return makeError("{}: tile {} or its parent is missing; build the dataset again", dataset.directory(),
                       toString(id));
    }
    auto tile = decodeAllLayers(*payloads, parent != nullptr ? &parent->samples : nullptr,
                                id.isRoot() ? 0 : id.quadrant(), dataset.manifest().scale);
    if (!tile) return makeError("{}: tile {}: {}", dataset.directory(), toString(id), tile.error().message);
    all.tiles_.emplace(id, std::make_unique<Tile>(std::move(tile).value()));
  }
  return all;
}

const Tile* AllTiles::find(TileId id) const {
  const auto found = tiles_.find(id);
  return found == tiles_.end() ? nullptr : found->second.get();
}

GridTilesCost selectGridTiles(const AllTiles& tiles, const Frame& frame, const ElevationScale& scale,
                              const Camera& camera, double tauPixels) {
  return GridSelection(tiles, frame, scale, camera, tauPixels).run();
}

}  // namespace terrane
