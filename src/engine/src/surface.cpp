#include "terrane/engine/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cell_height.h"

namespace terrane {
namespace {

/// The line from `from` in direction `step`, both in sample coordinates, at a share `t` of it.
struct Line {
  glm::dvec2 from;
  glm::dvec2 step;
  glm::dvec2 at(double t) const { return from + t * step; }
};

/// Where the line leaves a cell along one axis: the share, and the first cell of the finest level beyond.
struct Exit {
  double t = std::numeric_limits<double>::infinity();
  int64_t next = 0;
};
Exit exitOf(double from, double step, int64_t cell, int64_t size) {
  if (step > 0.0) return {(static_cast<double>(cell + size) - from) / step, cell + size};
  if (step < 0.0) return {(static_cast<double>(cell) - from) / step, cell - 1};
  return {};
}

/// The cell that a line is in just after a place: on an edge, the one that it goes into.
int64_t cellAfter(double place, double step) {
  const double cell = step < 0.0 ? std::ceil(place) - 1.0 : std::floor(place);
  return static_cast<int64_t>(cell);
}

/// The part of the line, as shares, inside the world; empty (begin > end) where it never is.
std::pair<double, double> clip(const Line& line, double side) {
  double begin = 0.0, end = 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    const double from = line.from[axis], step = line.step[axis];
    if (step == 0.0) {
      if (from < 0.0 || from > side) return {1.0, 0.0};
      continue;
    }
    const double a = -from / step, b = (side - from) / step;
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  return {begin, end};
}

}  // namespace

Status Surface::goTo(int64_t col, int64_t row) {
  const int finest = tiles_.dataset().manifest().frame.finestLevel;
  const auto tileAt = [&](int level) {
    const int shift = finest - level + 8;  // 256 cells a tile
    return TileId{level, static_cast<int32_t>(col >> shift), static_cast<int32_t>(row >> shift)};
  };
  while (!path_.empty() && path_.back().id != tileAt(path_.back().id.level)) path_.pop_back();
  if (path_.empty()) {
    TERRANE_ASSIGN(auto root, tiles_.get(TileId{}, nullptr));
    path_.push_back({TileId{}, std::move(root)});
  }
  while (path_.back().id.level < finest) {
    const TileId next = tileAt(path_.back().id.level + 1);
    const Tile& here = *path_.back().tile;
    if (here.children[static_cast<size_t>(next.quadrant())].state != ChildState::Present) break;
    TERRANE_ASSIGN(auto tile, tiles_.get(next, &here));
    path_.push_back({next, std::move(tile)});
  }
  return {};
}

Result<std::optional<double>> Surface::heightAt(glm::dvec2 sample) {
  const Frame& frame = tiles_.dataset().manifest().frame;
  const int64_t side = frame.worldCells();
  const auto sideAsDouble = static_cast<double>(side);
  if (!(sample.x >= 0.0 && sample.y >= 0.0 && sample.x <= sideAsDouble && sample.y <= sideAsDouble))
    return std::optional<double>{};
  TERRANE_TRY(goTo(std::min(static_cast<int64_t>(sample.x), side - 1),
                   std::min(static_cast<int64_t>(sample.y), side - 1)));
  const Level& here = path_.back();
  const double cellSize = std::ldexp(1.0, frame.finestLevel - here.id.level);
  const glm::dvec2 place =
      sample / cellSize - glm::dvec2(here.id.col, here.id.row) * static_cast<double>(kTileCells);
  return heightInTile(here.tile->samples, place);
}

Result<std::vector<SurfacePiece>> Surface::along(glm::dvec2 from, glm::dvec2 to, size_t maxPieces) {
  const Frame& frame = tiles_.dataset().manifest().frame;
  const int64_t side = frame.worldCells();
  const Line line{from, to - from};
  const auto [begin, end] = clip(line, static_cast<double>(side));
  std::vector<SurfacePiece> pieces;
  if (!(begin <= end)) return std::vector<SurfacePiece>{{0.0, 1.0, false, 0.0, 0.0}};
  if (begin > 0.0) pieces.push_back({0.0, begin, false, 0.0, 0.0});

  const auto clampCell = [&](int64_t cell) { return std::clamp<int64_t>(cell, 0, side - 1); };
  const glm::dvec2 entry = line.at(begin);
  int64_t col = clampCell(cellAfter(entry.x, line.step.x)), row = clampCell(cellAfter(entry.y, line.step.y));
  double t = begin;
  for (;;) {
    // The cell of the deepest stored tile, in cells of the finest level; from there the line goes on by
    // integers, so that rounding can never hold it up.
    TERRANE_TRY(goTo(col, row));
    const Level& here = path_.back();
    const int shift = frame.finestLevel - here.id.level;
    const int64_t size = int64_t{1} << shift;
    const int64_t cellCol = col >> shift << shift, cellRow = row >> shift << shift;
    const Exit exitX = exitOf(from.x, line.step.x, cellCol, size),
               exitY = exitOf(from.y, line.step.y, cellRow, size);
    const double leave = std::clamp(std::min(exitX.t, exitY.t), t, end);

    // One piece, or two where the line crosses the cell's diagonal.
    const auto cell = cellHeights(here.tile->samples, static_cast<int>((cellCol >> shift) % kTileCells),
                                  static_cast<int>((cellRow >> shift) % kTileCells));
    const auto placeAt = [&](double share) {
      const glm::dvec2 p = (line.at(share) - glm::dvec2(cellCol, cellRow)) / static_cast<double>(size);
      return glm::dvec2(std::clamp(p.x, 0.0, 1.0), std::clamp(p.y, 0.0, 1.0));
    };
    if (!cell) {
      if (!pieces.empty() && !pieces.back().isGround)
        pieces.back().end = leave;
      else
        pieces.push_back({t, leave, false, 0.0, 0.0});
    } else {
      const glm::dvec2 a = placeAt(t), b = placeAt(leave);
      const auto beside = [&](glm::dvec2 p) { return cell->evenDiagonal ? p.x - p.y : p.x + p.y - 1.0; };
      const double sideA = beside(a), sideB = beside(b);
      double from2 = t, height = cell->at(a.x, a.y);
      if ((sideA < 0.0 && sideB > 0.0) || (sideA > 0.0 && sideB < 0.0)) {
        const double share = sideA / (sideA - sideB);
        const glm::dvec2 middle = a + share * (b - a);
        const double middleHeight = cell->at(middle.x, middle.y);
        pieces.push_back({t, t + share * (leave - t), true, height, middleHeight});
        from2 = pieces.back().end;
        height = middleHeight;
      }
      pieces.push_back({from2, leave, true, height, cell->at(b.x, b.y)});
    }
    if (pieces.size() > maxPieces)
      return makeError("the line crosses more than {} triangles of the surface; ask for a shorter one",
                       maxPieces);

    t = leave;
    const bool byX = exitX.t <= exitY.t, byY = exitY.t <= exitX.t;
    if (leave >= end || (byX && (exitX.next < 0 || exitX.next >= side)) ||
        (byY && (exitY.next < 0 || exitY.next >= side)))
      break;
    const glm::dvec2 place = line.at(t);
    col =
        byX ? exitX.next : std::clamp(static_cast<int64_t>(std::floor(place.x)), cellCol, cellCol + size - 1);
    row =
        byY ? exitY.next : std::clamp(static_cast<int64_t>(std::floor(place.y)), cellRow, cellRow + size - 1);
  }
  if (t < 1.0) {
    if (t >= end && end >= 1.0)
      pieces.back().end = 1.0;
    else
      pieces.push_back({t, 1.0, false, 0.0, 0.0});
  }
  return pieces;
}

}  // namespace terrane
