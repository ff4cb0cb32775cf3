#include "terrane/reference/load_reference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "terrane/base/format_number.h"
#include "terrane/codec/elevation_codec.h"

namespace terrane {
namespace {

/// Reads and decodes a stored tile.
Result<Tile> readTile(const Dataset& dataset, TileId id, const Tile* parent) {
  TERRANE_ASSIGN(const auto payload, dataset.readElevation(id));
  if (!payload) {
    return makeError("{}: tile {} is missing; build the dataset again", dataset.directory(), toString(id));
  }
  auto tile = decodeTile(*payload, parent != nullptr ? &parent->samples : nullptr,
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

struct HeightProbe::State {
  static constexpr size_t kTilesHeld = 300;

  const Dataset& dataset;
  std::unordered_map<TileId, std::shared_ptr<const Tile>, TileIdHash> tiles;
  Status error;

  /// The tile, whether stored, interpolated or void; null after an error.
  std::shared_ptr<const Tile> tile(TileId id) {
    const auto known = tiles.find(id);
    if (known != tiles.end()) return known->second;
    std::shared_ptr<const Tile> parent;
    if (!id.isRoot()) {
      parent = tile(id.parent());
      if (!parent) return nullptr;
    }

    std::shared_ptr<const Tile> made;
    if (parent && parent->children[static_cast<size_t>(id.quadrant())].state != ChildState::Present) {
      made = std::make_shared<const Tile>(interpolateTile(*parent, id.quadrant()));
    } else {
      auto read = readTile(dataset, id, parent.get());
      if (!read) {
        if (error.ok()) error = read.error();
        return nullptr;
      }
      made = std::make_shared<const Tile>(std::move(read).value());
    }
    if (tiles.size() >= kTilesHeld) tiles.clear();
    tiles.emplace(id, made);
    return made;
  }
};

HeightProbe::HeightProbe(const Dataset& dataset) : state_(new State{dataset, {}, {}}) {}
HeightProbe::~HeightProbe() = default;
HeightProbe::HeightProbe(HeightProbe&&) noexcept = default;

const Status& HeightProbe::error() const {
  return state_->error;
}

double HeightProbe::heightAt(glm::dvec2 place) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const Manifest& manifest = state_->dataset.manifest();
  const glm::dvec2 sample = manifest.frame.sampleFromLocal(place);
  const auto cells = [](int64_t samples) { return static_cast<double>(samples - 1); };
  if (!(sample.x >= 0.0 && sample.y >= 0.0 && sample.x < cells(manifest.extentCols) &&
        sample.y < cells(manifest.extentRows))) {
    return kNone;
  }

  // One cell of the tile, as a surface of its own; its place in the world decides its diagonal.
  const auto col = static_cast<int64_t>(sample.x);
  const auto row = static_cast<int64_t>(sample.y);
  const TileId id{manifest.frame.finestLevel, static_cast<int32_t>(col / kTileCells),
                  static_cast<int32_t>(row / kTileCells)};
  const auto tile = state_->tile(id);
  const int x = static_cast<int>(col % kTileCells);
  const int y = static_cast<int>(row % kTileCells);
  if (!tile || !tile->samples.coverage.covered(x, y)) return kNone;
  const auto height = [&](int dx, int dy) {
    return static_cast<double>(tile->samples.heights[static_cast<size_t>((y + dy) * kTileSamples + x + dx)]);
  };
  const double a = sample.x - static_cast<double>(col);
  const double b = sample.y - static_cast<double>(row);
  return heightInCell((col + row) % 2 == 0, {height(0, 0), height(1, 0), height(0, 1), height(1, 1)}, a, b);
}

}  // namespace terrane
