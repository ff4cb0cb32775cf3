#pragma once

#include <algorithm>
#include <array>
#include <glm/vec2.hpp>
#include <optional>

#include "terrane/codec/tile.h"

namespace terrane {

/// Heights over one cell of a tile: two triangles, which share the diagonal that joins the even corners.
struct CellHeights {
  std::array<double, 4> corners{};  ///< north-west, north-east, south-west, south-east
  bool evenDiagonal = false;        ///< the diagonal joins north-west and south-east

  /// At (u, v) in [0, 1], u east and v south.
  double at(double u, double v) const {
    const auto& h = corners;
    if (evenDiagonal)
      return u >= v ? h[0] + u * (h[1] - h[0]) + v * (h[3] - h[1])
                    : h[0] + v * (h[2] - h[0]) + u * (h[3] - h[2]);
    return u + v <= 1.0 ? h[0] + u * (h[1] - h[0]) + v * (h[2] - h[0])
                        : h[3] + (1.0 - u) * (h[2] - h[3]) + (1.0 - v) * (h[1] - h[3]);
  }
  /// Positive and negative on either side of the diagonal.
  double besideDiagonal(glm::dvec2 p) const { return evenDiagonal ? p.x - p.y : p.x + p.y - 1.0; }
};

/// Which cells are ground.
enum class CellGround : uint8_t {
  Corners,   ///< those whose four corners are: right where no finer tile is stored
  Coverage,  ///< those that are drawn: mostly ground, as far as finer tiles know
  Any,       ///< all: where there is none, what the void was filled with
};

/// The heights of cell (col, row), or nothing where it is not ground.
inline std::optional<CellHeights> cellHeights(const TileSamples& samples, int col, int row,
                                              CellGround ground = CellGround::Corners) {
  if (ground == CellGround::Coverage && !samples.coverage.covered(col, row)) return {};
  CellHeights cell;
  cell.evenDiagonal = (col + row) % 2 == 0;
  for (int corner = 0; corner < 4; ++corner) {
    const auto at = static_cast<size_t>((row + (corner >> 1)) * kTileSamples + col + (corner & 1));
    if (ground == CellGround::Corners && samples.states[at] == SampleState::Void) return {};
    cell.corners[static_cast<size_t>(corner)] = static_cast<double>(samples.heights[at]);
  }
  return cell;
}

/// The height at a place in the tile's cells, [0, 256] both ways, or nothing where there is no ground.
inline std::optional<double> heightInTile(const TileSamples& samples, glm::dvec2 place,
                                          CellGround ground = CellGround::Corners) {
  const int col = std::clamp(static_cast<int>(place.x), 0, kTileCells - 1);
  const int row = std::clamp(static_cast<int>(place.y), 0, kTileCells - 1);
  const auto cell = cellHeights(samples, col, row, ground);
  if (!cell) return {};
  return cell->at(place.x - col, place.y - row);
}

}  // namespace terrane
