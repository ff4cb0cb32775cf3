#include "terrane/reference/load_reference.h"

#include <algorithm>
#include <utility>

#include "terrane/base/format_number.h"
#include "terrane/codec/all_layers.h"
#include "terrane/codec/elevation_codec.h"

namespace terrane {
namespace {

/// Reads and decodes a stored tile.
Result<Tile> readTile(const Dataset& dataset, TileId id, const Tile* parent) {
  TERRANE_ASSIGN(const auto payloads, dataset.readAllLayers(id));
  if (!payloads) {
    return makeError("{}: tile {} is missing; build the dataset again", dataset.directory(), toString(id));
  }
  auto tile = decodeAllLayers(*payloads, parent != nullptr ? &parent->samples : nullptr,
                              id.isRoot() ? 0 : id.quadrant(), dataset.manifest().scale);
  if (!tile) return makeError("{}: tile {}: {}", dataset.directory(), toString(id), tile.error().message);
  return tile;
}

/// Copies what lies inside the grid of a tile of the finest level.
void copyTile(const Tile& tile, TileId id, ReferenceGrid& grid) {
  const int64_t west = static_cast<int64_t>(id.col) * kTileCells;
  const int64_t north = static_cast<int64_t>(id.row) * kTileCells;
  const int64_t cols = std::min<int64_t>(kTileSamples, grid.cols - west);
  const int64_t rows = std::min<int64_t>(kTileSamples, grid.rows - north);
  for (int64_t y = 0; y < rows; ++y) {
    const auto from = tile.samples.heights.begin() + static_cast<std::ptrdiff_t>(y * kTileSamples);
    std::copy_n(from, cols,
                grid.heights.begin() + static_cast<std::ptrdiff_t>((north + y) * grid.cols + west));
  }
  if (tile.samples.coverage.kind == Coverage::Kind::None) return;
  for (int64_t y = 0; y < rows - 1; ++y) {
    for (int64_t x = 0; x < cols - 1; ++x) {
      if (tile.samples.coverage.covered(static_cast<int>(x), static_cast<int>(y)))
        grid.setGround(west + x, north + y);
    }
  }
}

/// Goes down from a tile to the finest level, depth first, so that only one chain of tiles is held.
Status descend(const Dataset& dataset, TileId id, const Tile& tile, ReferenceGrid& grid) {
  const int finest = dataset.manifest().frame.finestLevel;
  if (id.level == finest) {
    copyTile(tile, id, grid);
    return {};
  }
  for (int quadrant = 0; quadrant < 4; ++quadrant) {
    const TileId childId = id.child(quadrant);
    const int64_t side = static_cast<int64_t>(kTileCells) << (finest - childId.level);
    if (childId.col * side >= grid.cols - 1 || childId.row * side >= grid.rows - 1) continue;
    switch (tile.children[static_cast<size_t>(quadrant)].state) {
      case ChildState::Void:
        break;
      case ChildState::Interpolated:
        TERRANE_TRY(descend(dataset, childId, interpolateTile(tile, quadrant), grid));
        break;
      case ChildState::Present: {
        TERRANE_ASSIGN(const Tile child, readTile(dataset, childId, &tile));
        TERRANE_TRY(descend(dataset, childId, child, grid));
        break;
      }
    }
  }
  return {};
}

}  // namespace

Result<ReferenceSurface> loadReference(const Dataset& dataset, const ReferenceOptions& options) {
  const Manifest& manifest = dataset.manifest();
  if (manifest.extentCols < 2 || manifest.extentRows < 2) {
    return makeError("{}: an extent of {} x {} samples has no surface", dataset.directory(),
                     manifest.extentCols, manifest.extentRows);
  }
  const double bytes =
      5.5 * static_cast<double>(manifest.extentCols) * static_cast<double>(manifest.extentRows);
  if (bytes > static_cast<double>(options.memoryBytes)) {
    return makeError("{}: the full-resolution surface of {} x {} samples needs {} of memory, {} are allowed",
                     dataset.directory(), manifest.extentCols, manifest.extentRows,
                     formatBytes(static_cast<uint64_t>(bytes)), formatBytes(options.memoryBytes));
  }

  ReferenceGrid grid;
  grid.cols = manifest.extentCols;
  grid.rows = manifest.extentRows;
  grid.spacingX = manifest.frame.spacingXMeters();
  grid.spacingY = manifest.frame.spacingYMeters();
  grid.heights.assign(static_cast<size_t>(grid.cols * grid.rows), 0.0F);
  grid.groundCells.assign(static_cast<size_t>(((grid.cols - 1) * (grid.rows - 1) + 7) / 8), 0);
  TERRANE_ASSIGN(const Tile root, readTile(dataset, TileId{}, nullptr));
  TERRANE_TRY(descend(dataset, TileId{}, root, grid));
  return ReferenceSurface(std::move(grid));
}

int64_t coarsestCellMargin(const Frame& frame) {
  return int64_t{2} << frame.finestLevel;
}

}  // namespace terrane
