#include "terrane/engine/elevation_query.h"

#include <algorithm>
#include <array>
#include <cmath>

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

  // The triangle under the place: cells are cut along the diagonal that joins their even corners.
  const TileSamples& samples = pool_.find(id)->samples;
  const int col = std::clamp(static_cast<int>(cell.x), 0, kTileCells - 1);
  const int row = std::clamp(static_cast<int>(cell.y), 0, kTileCells - 1);
  const double u = cell.x - col, v = cell.y - row;
  std::array<double, 4> h{};
  for (int corner = 0; corner < 4; ++corner) {
    const auto at = static_cast<size_t>((row + (corner >> 1)) * kTileSamples + col + (corner & 1));
    if (samples.states[at] == SampleState::Void) return nothing;
    h[static_cast<size_t>(corner)] = static_cast<double>(samples.heights[at]);
  }
  double height = 0.0;
  if ((col + row) % 2 == 0) {
    height =
        u >= v ? h[0] + u * (h[1] - h[0]) + v * (h[3] - h[1]) : h[0] + v * (h[2] - h[0]) + u * (h[3] - h[2]);
  } else {
    height = u + v <= 1.0 ? h[0] + u * (h[1] - h[0]) + v * (h[2] - h[0])
                          : h[3] + (1.0 - u) * (h[2] - h[3]) + (1.0 - v) * (h[1] - h[3]);
  }
  return std::optional<double>(height);
}

}  // namespace terrane
