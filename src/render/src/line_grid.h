#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "terrane/render/ground_lines.h"

/// Which line segments are near a place on the ground: a pyramid of square cells, each with a list, as the
/// shader of lines looks them up (shaders/ground_lines.frag; docs/architecture.md, "Lines").
///
/// A cell's list holds every segment within half a cell, and half the width of lines in metres, of the cell.
/// So a pixel that must know all segments within R metres looks into one cell: that of the finest level whose
/// cells are 2 R wide. On each level lines are simplified to a five-hundredth of its cells.
namespace terrane {

/// A cell's record: its column and row (from local (0, 0) to the east and **north**), where its list begins,
/// and its length | level << 20; a length of 0 is no cell.
using LineCell = std::array<int32_t, 4>;
/// A list's entry: both ends from the cell's middle in quanta of the level, x | y << 16 each; the line's
/// number; 0. Later lines come first, and the segments of one line together.
using LineEntry = std::array<int32_t, 4>;

struct LineGrid {
  static constexpr int kMostCellLines = (1 << 20) - 1;  ///< the bits of a list's length
  static constexpr int kMostList = 2048;                ///< what is longer loses its earliest lines
  static constexpr int kMostLevels = 24;

  double finestCellMeters = 1.0;  ///< a power of two; a level's cells are twice as wide as those before
  int levels = 0;                 ///< 0: there are no lines
  double reachMeters = 0.0;       ///< half of the widest line whose width is in metres
  double reachPixels = 0.0;       ///< half of the widest line whose width is in pixels
  std::vector<LineCell> slots;    ///< a hash table of a power of two slots, at most half full
  std::vector<LineEntry> entries;

  double cellMeters(int level) const { return finestCellMeters * static_cast<double>(int64_t{1} << level); }
  double quantumMeters(int level) const { return quantum(cellMeters(level), reachMeters); }
  static double quantum(double cellMeters, double reachMeters) {
    return (2.25 * cellMeters + 2.0 * reachMeters) / 65000.0;
  }
  /// Where a cell's search begins in `slots`, before it is cut to their number; the same in the shader.
  static uint32_t hash(int32_t col, int32_t row, int32_t level);
  /// The cell's list; empty where there is none.
  std::span<const LineEntry> find(int32_t col, int32_t row, int32_t level) const;
};

/// Lists the segments of lines. Corners that are not finite are passed over. Cost: some 20 ms for ten
/// thousand segments, most of it sorting.
LineGrid makeLineGrid(std::span<const GroundLine> lines);

}  // namespace terrane
