#include "terrane/engine/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "terrane/codec/cell_height.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {
namespace {

/// Finest cells: a place so near a border is on it, whatever its coordinates were rounded to.
constexpr double kOnBorder = 1e-6;

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

/// The cell of a place on a line; along the data's last row or column, the one before it.
int64_t cellAt(double place, double step, int64_t extent) {
  if (step == 0.0 && std::abs(place - static_cast<double>(extent - 1)) <= kOnBorder) return extent - 2;
  return static_cast<int64_t>(std::floor(place));
}
/// The same just after it: on an edge, the one that the line goes into.
int64_t cellAfter(double place, double step, int64_t extent) {
  return step < 0.0 ? static_cast<int64_t>(std::ceil(place)) - 1 : cellAt(place, step, extent);
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

CellGround groundOf(bool isUnfinished) {
  return isUnfinished ? CellGround::Coverage : CellGround::Corners;
}

/// Cells along the side of what firstHit() passes over at once.
constexpr int kBlockCells = 16;

/// The least and greatest height of a block's samples.
struct HeightRange {
  float low = std::numeric_limits<float>::infinity();
  float high = -std::numeric_limits<float>::infinity();
};
HeightRange rangeOfBlock(const TileSamples& samples, int firstCol, int firstRow) {
  HeightRange out;
  for (int row = firstRow; row <= firstRow + kBlockCells; ++row) {
    const float* at = samples.heights.data() + row * kTileSamples + firstCol;
    for (int i = 0; i <= kBlockCells; ++i) {
      out.low = std::min(out.low, at[i]);
      out.high = std::max(out.high, at[i]);
    }
  }
  return out;
}

/// Which side of the ground a line through the air is on, followed from triangle to triangle.
class Crossing {
 public:
  explicit Crossing(double fromHeight, double toHeight) : from_(fromHeight), step_(toHeight - fromHeight) {}

  double lineAt(double t) const { return from_ + t * step_; }
  void skip(bool isAbove) { side_ = isAbove ? 1 : -1; }
  void overVoid() { side_ = 0; }
  /// Does the line go through the ground, which is at `begin` and `end` so high, between shares of it? The
  /// ground may have jumped since the last triangle.
  std::optional<SurfaceHit> cross(double begin, double end, double beginHeight, double endHeight) {
    const double aboveBegin = lineAt(begin) - beginHeight, aboveEnd = lineAt(end) - endHeight;
    if (side_ * aboveBegin < 0.0) return SurfaceHit{begin, lineAt(begin)};
    if ((aboveBegin < 0.0 && aboveEnd >= 0.0) || (aboveBegin > 0.0 && aboveEnd <= 0.0)) {
      const double t = begin + aboveBegin / (aboveBegin - aboveEnd) * (end - begin);
      return SurfaceHit{t, lineAt(t)};
    }
    if (aboveEnd != 0.0) side_ = aboveEnd > 0.0 ? 1 : -1;
    return {};
  }

 private:
  double from_;
  double step_;
  int side_ = 0;
};

}  // namespace

Status Surface::goTo(int64_t col, int64_t row) {
  const int finest = source_.manifest().frame.finestLevel;
  const auto tileAt = [&](int level) {
    const int shift = finest - level + 8;  // 256 cells a tile
    return TileId{level, static_cast<int32_t>(col >> shift), static_cast<int32_t>(row >> shift)};
  };
  while (!path_.empty() && path_.back().id != tileAt(path_.back().id.level)) path_.pop_back();
  if (path_.empty()) {
    TERRANE_ASSIGN(auto root, source_.get(TileId{}, nullptr));
    path_.push_back({TileId{}, std::move(root)});
  }
  isUnfinished_ = path_.back().tile == nullptr;
  while (!isUnfinished_ && path_.back().id.level < finest) {
    const TileId next = tileAt(path_.back().id.level + 1);
    Level& here = path_.back();
    const int quadrant = next.quadrant();
    if (here.tile->children[static_cast<size_t>(quadrant)].state != ChildState::Present) break;
    isUnfinished_ = here.id.level >= finestLevel_ || (here.absent >> quadrant & 1) != 0;
    if (isUnfinished_) break;
    TERRANE_ASSIGN(auto tile, source_.get(next, here.tile.get()));
    isUnfinished_ = tile == nullptr;
    if (isUnfinished_)
      here.absent = static_cast<uint8_t>(here.absent | 1U << quadrant);
    else
      path_.push_back({next, std::move(tile)});
  }
  return {};
}

Result<bool> Surface::goTo(glm::dvec2 sample) {
  const int64_t side = source_.manifest().frame.worldCells();
  const auto sideAsDouble = static_cast<double>(side);
  if (!(sample.x >= 0.0 && sample.y >= 0.0 && sample.x <= sideAsDouble && sample.y <= sideAsDouble))
    return false;
  TERRANE_TRY(goTo(std::min(static_cast<int64_t>(sample.x), side - 1),
                   std::min(static_cast<int64_t>(sample.y), side - 1)));
  return path_.back().tile != nullptr;
}

glm::dvec2 Surface::placeInTile(glm::dvec2 sample) const {
  const TileId id = path_.back().id;
  const double cellSize = std::ldexp(1.0, source_.manifest().frame.finestLevel - id.level);
  return sample / cellSize - glm::dvec2(id.col, id.row) * static_cast<double>(kTileCells);
}

Result<std::optional<double>> Surface::heightAt(glm::dvec2 sample) {
  TERRANE_ASSIGN(const bool isInside, goTo(sample));
  if (isInside) {
    const auto height =
        heightInTile(path_.back().tile->samples, placeInTile(sample), groundOf(isUnfinished_));
    if (height) return height;
  }
  return heightAtBorder(sample);
}

Result<std::optional<double>> Surface::heightAtBorder(glm::dvec2 sample) {
  const glm::dvec2 nearest(std::round(sample.x), std::round(sample.y));
  const bool isBetweenColumns = std::abs(sample.x - nearest.x) <= kOnBorder,
             isBetweenRows = std::abs(sample.y - nearest.y) <= kOnBorder;
  for (int side = 1; side < 4; ++side) {
    const int west = side & 1, north = side >> 1;
    if ((west != 0 && !isBetweenColumns) || (north != 0 && !isBetweenRows)) continue;
    // The middle of the cell, and the place in it, which may be a little beyond.
    const glm::dvec2 middle(west != 0 ? nearest.x - 0.5 : std::floor(sample.x) + 0.5,
                            north != 0 ? nearest.y - 0.5 : std::floor(sample.y) + 0.5);
    TERRANE_ASSIGN(const bool isInside, goTo(middle));
    if (!isInside) continue;
    const glm::dvec2 inTile = placeInTile(middle), place = placeInTile(sample);
    const int col = static_cast<int>(inTile.x), row = static_cast<int>(inTile.y);
    const auto cell = cellHeights(path_.back().tile->samples, col, row, groundOf(isUnfinished_));
    if (cell)
      return std::optional(
          cell->at(std::clamp(place.x - col, 0.0, 1.0), std::clamp(place.y - row, 0.0, 1.0)));
  }
  return std::optional<double>{};
}

Result<std::optional<double>> Surface::filledHeightAt(glm::dvec2 sample) {
  TERRANE_ASSIGN(const bool isInside, goTo(sample));
  if (!isInside) return std::optional<double>{};
  return heightInTile(path_.back().tile->samples, placeInTile(sample), CellGround::Any);
}

Result<std::optional<double>> Surface::errorAt(glm::dvec2 sample) {
  TERRANE_ASSIGN(const auto height, heightAt(sample));
  if (!height) return std::optional<double>{};
  const Manifest& manifest = source_.manifest();
  const TileSamples& samples = path_.back().tile->samples;
  const int layer = samples.layerCount - 1;
  if (!isUnfinished_) {
    const bool isWhole = layer + 1 == manifest.scale.layerCount;
    return std::optional<double>{isWhole ? manifest.maxErrorMeters
                                         : manifest.scale.layerErrors[static_cast<size_t>(layer)]};
  }

  // The patch of 16 x 16 cells shows all of the tile's samples, and its node tells how far off they are.
  constexpr int kLevel = kNodeLevels - 1, kHalf = nodeHalfSize(kLevel);
  const glm::dvec2 place = placeInTile(sample);
  const auto middle = [](double cells) {
    return std::clamp(static_cast<int>(cells), 0, kTileCells - 1) / (2 * kHalf) * (2 * kHalf) + kHalf;
  };
  const Level& here = path_.back();
  const int node = nodeIndex(kLevel, middle(place.x), middle(place.y), here.id.isRoot());
  return std::optional<double>{
      std::max(manifest.scale.errorFromCode(here.tile->nodes.error[static_cast<size_t>(node)]),
               manifest.maxErrorMeters) +
      manifest.scale.layerOffset(layer)};
}

Result<std::vector<SurfacePiece>> Surface::along(glm::dvec2 from, glm::dvec2 to, size_t maxPieces) {
  const Frame& frame = source_.manifest().frame;
  const int64_t side = frame.worldCells();
  const Line line{from, to - from};
  const auto [begin, end] = clip(line, static_cast<double>(side));
  std::vector<SurfacePiece> pieces;
  if (!(begin <= end)) return std::vector<SurfacePiece>{{0.0, 1.0, false, 0.0, 0.0}};
  if (begin > 0.0) pieces.push_back({0.0, begin, false, 0.0, 0.0});

  const auto clampCell = [&](int64_t cell) { return std::clamp<int64_t>(cell, 0, side - 1); };
  const glm::dvec2 entry = line.at(begin);
  const Manifest& manifest = source_.manifest();
  int64_t col = clampCell(cellAfter(entry.x, line.step.x, manifest.extentCols)),
          row = clampCell(cellAfter(entry.y, line.step.y, manifest.extentRows));
  double t = begin;
  for (;;) {
    // The cell of the deepest stored tile, in cells of the finest level; from there the line goes on by
    // integers, so that rounding can never hold it up.
    TERRANE_TRY(goTo(col, row));
    const Level& here = path_.back();
    if (here.tile == nullptr) return std::vector<SurfacePiece>{{0.0, 1.0, false, 0.0, 0.0}};
    const int shift = frame.finestLevel - here.id.level;
    const int64_t size = int64_t{1} << shift;
    const int64_t cellCol = col >> shift << shift, cellRow = row >> shift << shift;
    const Exit exitX = exitOf(from.x, line.step.x, cellCol, size),
               exitY = exitOf(from.y, line.step.y, cellRow, size);
    const double leave = std::clamp(std::min(exitX.t, exitY.t), t, end);

    // One piece, or two where the line crosses the cell's diagonal.
    const auto cell = cellHeights(here.tile->samples, static_cast<int>((cellCol >> shift) % kTileCells),
                                  static_cast<int>((cellRow >> shift) % kTileCells), groundOf(isUnfinished_));
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
      const double sideA = cell->besideDiagonal(a), sideB = cell->besideDiagonal(b);
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
    col = byX ? exitX.next
              : std::clamp(cellAt(place.x, line.step.x, manifest.extentCols), cellCol, cellCol + size - 1);
    row = byY ? exitY.next
              : std::clamp(cellAt(place.y, line.step.y, manifest.extentRows), cellRow, cellRow + size - 1);
  }
  if (t < 1.0) {
    if (t >= end && end >= 1.0)
      pieces.back().end = 1.0;
    else
      pieces.push_back({t, 1.0, false, 0.0, 0.0});
  }
  return pieces;
}

Result<std::optional<SurfaceHit>> Surface::firstHit(glm::dvec3 from, glm::dvec3 to) {
  const Frame& frame = source_.manifest().frame;
  const int64_t side = frame.worldCells();
  const Line line{glm::dvec2(from), glm::dvec2(to) - glm::dvec2(from)};
  const auto [begin, end] = clip(line, static_cast<double>(side));
  if (!(begin <= end)) return std::optional<SurfaceHit>{};
  Crossing crossing(from.z, to.z);

  const auto clampCell = [&](int64_t cell) { return std::clamp<int64_t>(cell, 0, side - 1); };
  const glm::dvec2 entry = line.at(begin);
  const Manifest& manifest = source_.manifest();
  int64_t col = clampCell(cellAfter(entry.x, line.step.x, manifest.extentCols)),
          row = clampCell(cellAfter(entry.y, line.step.y, manifest.extentRows));
  double t = begin;
  TileId rangedTile{-1, 0, 0};
  int rangedBlock = -1;
  HeightRange range;
  for (;;) {
    TERRANE_TRY(goTo(col, row));
    const Level& here = path_.back();
    if (here.tile == nullptr) return std::optional<SurfaceHit>{};
    const TileSamples& samples = here.tile->samples;
    const int shift = frame.finestLevel - here.id.level;
    const int tileCol = static_cast<int>((col >> shift) % kTileCells),
              tileRow = static_cast<int>((row >> shift) % kTileCells);

    // A block that is all below the line, or above it, is passed over at once.
    constexpr int kBlockShift = 4;
    static_assert(1 << kBlockShift == kBlockCells);
    const int block = (tileRow >> kBlockShift) * kBlockCells + (tileCol >> kBlockShift);
    if (rangedTile != here.id || rangedBlock != block) {
      range = rangeOfBlock(samples, tileCol & -kBlockCells, tileRow & -kBlockCells);
      rangedTile = here.id;
      rangedBlock = block;
    }
    int sizeShift = shift + kBlockShift;
    const auto exits = [&] {
      const int64_t size = int64_t{1} << sizeShift;
      return std::pair{exitOf(from.x, line.step.x, col >> sizeShift << sizeShift, size),
                       exitOf(from.y, line.step.y, row >> sizeShift << sizeShift, size)};
    };
    auto leaving = exits();
    double leave = std::clamp(std::min(leaving.first.t, leaving.second.t), t, end);
    const double lowest = std::min(crossing.lineAt(t), crossing.lineAt(leave)),
                 highest = std::max(crossing.lineAt(t), crossing.lineAt(leave));
    if (lowest > static_cast<double>(range.high) || highest < static_cast<double>(range.low)) {
      crossing.skip(lowest > static_cast<double>(range.high));
    } else {
      // One cell: one piece, or two where the line crosses its diagonal.
      sizeShift = shift;
      leaving = exits();
      leave = std::clamp(std::min(leaving.first.t, leaving.second.t), t, end);
      const auto cell = cellHeights(samples, tileCol, tileRow, groundOf(isUnfinished_));
      if (!cell) {
        crossing.overVoid();
      } else {
        const glm::dvec2 corner(static_cast<double>(col >> shift << shift),
                                static_cast<double>(row >> shift << shift));
        const auto placeAt = [&](double share) {
          const glm::dvec2 p = (line.at(share) - corner) / std::ldexp(1.0, shift);
          return glm::dvec2(std::clamp(p.x, 0.0, 1.0), std::clamp(p.y, 0.0, 1.0));
        };
        const glm::dvec2 a = placeAt(t), b = placeAt(leave);
        const double sideA = cell->besideDiagonal(a), sideB = cell->besideDiagonal(b);
        double pieceBegin = t, height = cell->at(a.x, a.y);
        if ((sideA < 0.0 && sideB > 0.0) || (sideA > 0.0 && sideB < 0.0)) {
          const double share = sideA / (sideA - sideB);
          const glm::dvec2 middle = a + share * (b - a);
          const double middleHeight = cell->at(middle.x, middle.y);
          const double pieceEnd = t + share * (leave - t);
          if (const auto hit = crossing.cross(pieceBegin, pieceEnd, height, middleHeight)) return hit;
          pieceBegin = pieceEnd;
          height = middleHeight;
        }
        if (const auto hit = crossing.cross(pieceBegin, leave, height, cell->at(b.x, b.y))) return hit;
      }
    }

    // On to the next cell, by integers, so that rounding can never hold it up.
    t = leave;
    const Exit exitX = leaving.first, exitY = leaving.second;
    const bool byX = exitX.t <= exitY.t, byY = exitY.t <= exitX.t;
    if (leave >= end || (byX && (exitX.next < 0 || exitX.next >= side)) ||
        (byY && (exitY.next < 0 || exitY.next >= side)))
      return std::optional<SurfaceHit>{};
    const glm::dvec2 place = line.at(t);
    const auto within = [&](int64_t at, int64_t cell) {
      const int64_t first = cell >> sizeShift << sizeShift;
      return std::clamp(at, first, first + (int64_t{1} << sizeShift) - 1);
    };
    col = byX ? exitX.next : within(cellAt(place.x, line.step.x, manifest.extentCols), col);
    row = byY ? exitY.next : within(cellAt(place.y, line.step.y, manifest.extentRows), row);
  }
}

}  // namespace terrane
