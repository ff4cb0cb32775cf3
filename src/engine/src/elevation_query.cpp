#include "terrane/engine/elevation_query.h"

#include <array>
#include <cmath>

#include "terrane/codec/cell_height.h"

namespace terrane {

Result<std::optional<double>> ElevationQuery::heightAt(glm::dvec2 local) {
  const std::optional<double> nothing;
  const Frame& frame = dataset_.manifest().frame;
  const glm::dvec2 sample = frame.sampleFromLocal(local);
  const double side = static_cast<double>(frame.worldCells());
  if (!(sample.x >= 0.0 && sample.y >= 0.0 && sample.x <= side && sample.y <= side)) return nothing;

  // Walk down to the deepest tile that is stored there.
  if (pool_.residentTiles() > maxTiles_) pool_.clear();
  const std::array<TileId, 1> root{};
  TERRANE_TRY(pool_.load(root));
  TileId id;
  glm::dvec2 cell;  // in the tile's cells
  for (;;) {
    const double cellSize = std::ldexp(1.0, frame.finestLevel - id.level);
    cell = sample / cellSize - glm::dvec2(id.col, id.row) * static_cast<double>(kTileCells);
    if (id.level == frame.finestLevel) break;
    constexpr double kHalf = 0.5 * kTileCells;
    const int quadrant = (cell.x >= kHalf ? 1 : 0) | (cell.y >= kHalf ? 2 : 0);
    if (pool_.find(id)->children[static_cast<size_t>(quadrant)].state != ChildState::Present) break;
    id = id.child(quadrant);
    const std::array<TileId, 1> next{id};
    TERRANE_TRY(pool_.load(next));
  }

  return heightInTile(pool_.find(id)->samples, cell);
}

}  // namespace terrane
