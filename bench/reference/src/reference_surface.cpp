#include "terrane/reference/reference_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "terrane/base/check.h"

namespace terrane {
namespace {

constexpr int64_t kFinestBlockCells = 4;
/// How far a triangle reaches over its edges, in cells.
constexpr double kEdge = 1e-9;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Narrows [enter, leave] to where a ray is between `low` and `high` along one axis; false: nowhere.
bool clip(double origin, double inverse, double low, double high, double& enter, double& leave) {
  if (std::isinf(inverse)) return origin >= low && origin <= high;
  const double first = (low - origin) * inverse;
  const double second = (high - origin) * inverse;
  enter = std::max(enter, std::min(first, second));
  leave = std::min(leave, std::max(first, second));
  return enter <= leave;
}

/// A triangle of a cell: z = base + slopeA * a + slopeB * b, with a and b across the cell from its
/// north-west corner, and a sign that tells its side of the diagonal.
struct Facet {
  double base;
  double slopeA;
  double slopeB;
};

/// The cell's two triangles. Even cells have the diagonal a = b and first the triangle a >= b, odd ones the
/// diagonal a + b = 1 and first the triangle a + b <= 1.
std::array<Facet, 2> facetsOf(bool even, const std::array<double, 4>& corners) {
  const auto [nw, ne, sw, se] = corners;
  if (even) return {Facet{nw, ne - nw, se - ne}, Facet{nw, se - sw, sw - nw}};
  return {Facet{nw, ne - nw, sw - nw}, Facet{ne + sw - se, se - sw, se - ne}};
}

/// Positive on the first triangle's side of the diagonal.
double sideOfDiagonal(bool even, double a, double b) {
  return even ? a - b : 1.0 - a - b;
}

}  // namespace

double heightInCell(bool even, const std::array<double, 4>& corners, double a, double b) {
  const auto facets = facetsOf(even, corners);
  const Facet& facet = facets[sideOfDiagonal(even, a, b) >= 0.0 ? 0 : 1];
  return facet.base + facet.slopeA * a + facet.slopeB * b;
}

ReferenceSurface::ReferenceSurface(ReferenceGrid grid) : grid_(std::move(grid)) {
  TERRANE_CHECK(grid_.cols >= 2 && grid_.rows >= 2, "a grid of {} x {} samples", grid_.cols, grid_.rows);
  TERRANE_CHECK(grid_.heights.size() == static_cast<size_t>(grid_.cols * grid_.rows), "{} heights",
                grid_.heights.size());

  // The finest blocks from the samples, the others from the four below.
  Level finest;
  finest.cells = kFinestBlockCells;
  finest.cols = (grid_.cols - 1 + finest.cells - 1) / finest.cells;
  finest.rows = (grid_.rows - 1 + finest.cells - 1) / finest.cells;
  finest.blocks.resize(static_cast<size_t>(finest.cols * finest.rows));
  for (int64_t row = 0; row < finest.rows; ++row) {
    for (int64_t col = 0; col < finest.cols; ++col) {
      finest.blocks[static_cast<size_t>(row * finest.cols + col)] =
          boundsOfCells(col * finest.cells, row * finest.cells, finest.cells);
    }
  }
  levels_.push_back(std::move(finest));
  while (levels_.back().blocks.size() > 1) {
    const Level& below = levels_.back();
    Level level;
    level.cells = below.cells * 2;
    level.cols = (below.cols + 1) / 2;
    level.rows = (below.rows + 1) / 2;
    level.blocks.resize(static_cast<size_t>(level.cols * level.rows));
    for (int64_t row = 0; row < below.rows; ++row) {
      for (int64_t col = 0; col < below.cols; ++col) {
        const Block& from = below.blocks[static_cast<size_t>(row * below.cols + col)];
        Block& to = level.blocks[static_cast<size_t>((row / 2) * level.cols + col / 2)];
        if (from.low > from.high) continue;
        to = to.low > to.high ? from : Block{std::min(to.low, from.low), std::max(to.high, from.high)};
      }
    }
    levels_.push_back(std::move(level));
  }
}

ReferenceSurface::Block ReferenceSurface::boundsOfCells(int64_t i0, int64_t j0, int64_t cells) const {
  Block bounds{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  for (int64_t j = j0; j < std::min(j0 + cells, grid_.rows - 1); ++j) {
    for (int64_t i = i0; i < std::min(i0 + cells, grid_.cols - 1); ++i) {
      if (!grid_.isGround(i, j)) continue;
      for (const float height :
           {grid_.height(i, j), grid_.height(i + 1, j), grid_.height(i, j + 1), grid_.height(i + 1, j + 1)}) {
        bounds.low = std::min(bounds.low, height);
        bounds.high = std::max(bounds.high, height);
      }
    }
  }
  return bounds.low <= bounds.high ? bounds : Block{};
}

ReferenceSurface::Ray ReferenceSurface::toSamples(glm::dvec3 origin, glm::dvec3 direction) const {
  const glm::dvec3 scale(1.0 / grid_.spacingX, -1.0 / grid_.spacingY, 1.0);
  const glm::dvec3 along = direction * scale;
  return {origin * scale, along, 1.0 / along};
}

std::optional<ReferenceSurface::Hit> ReferenceSurface::cast(glm::dvec3 origin, glm::dvec3 direction) const {
  std::optional<Hit> best;
  castBlock(levels_.size() - 1, 0, 0, toSamples(origin, direction), best);
  if (best) best->point = origin + best->distance * direction;
  return best;
}

void ReferenceSurface::castBlock(size_t levelIndex, int64_t col, int64_t row, const Ray& ray,
                                 std::optional<Hit>& best) const {
  // Leave blocks that the ray misses, or meets only behind what it has met already.
  const Level& level = levels_[levelIndex];
  const Block& block = level.blocks[static_cast<size_t>(row * level.cols + col)];
  if (block.low > block.high) return;
  const auto west = static_cast<double>(col * level.cells);
  const auto north = static_cast<double>(row * level.cells);
  const auto side = static_cast<double>(level.cells);
  const double margin = 1e-9 * (1.0 + std::abs(block.low) + std::abs(block.high));
  double enter = 0.0;
  double leave = best ? best->distance : kInfinity;
  if (!clip(ray.origin.z, ray.inverse.z, block.low - margin, block.high + margin, enter, leave) ||
      !clip(ray.origin.x, ray.inverse.x, west - kEdge, west + side + kEdge, enter, leave) ||
      !clip(ray.origin.y, ray.inverse.y, north - kEdge, north + side + kEdge, enter, leave)) {
    return;
  }

  // Of the four blocks below, those nearer along each axis come first; the two in the middle are never both
  // met. The same holds for the cells of the finest blocks.
  const bool westward = ray.direction.x < 0.0;
  const bool northward = ray.direction.y < 0.0;
  if (levelIndex > 0) {
    const Level& below = levels_[levelIndex - 1];
    for (int i = 0; i < 4; ++i) {
      const int64_t childCol = 2 * col + ((i & 1) ^ (westward ? 1 : 0));
      const int64_t childRow = 2 * row + ((i >> 1) ^ (northward ? 1 : 0));
      if (childCol < below.cols && childRow < below.rows)
        castBlock(levelIndex - 1, childCol, childRow, ray, best);
    }
    return;
  }
  for (int64_t y = 0; y < level.cells; ++y) {
    const int64_t j = row * level.cells + (northward ? level.cells - 1 - y : y);
    if (j >= grid_.rows - 1) continue;
    for (int64_t x = 0; x < level.cells; ++x) {
      const int64_t i = col * level.cells + (westward ? level.cells - 1 - x : x);
      if (i < grid_.cols - 1 && grid_.isGround(i, j)) castCell(i, j, ray, best);
    }
  }
}

void ReferenceSurface::castCell(int64_t i, int64_t j, const Ray& ray, std::optional<Hit>& best) const {
  double enter = 0.0;
  double leave = best ? best->distance : kInfinity;
  const auto west = static_cast<double>(i);
  const auto north = static_cast<double>(j);
  if (!clip(ray.origin.x, ray.inverse.x, west - kEdge, west + 1.0 + kEdge, enter, leave) ||
      !clip(ray.origin.y, ray.inverse.y, north - kEdge, north + 1.0 + kEdge, enter, leave)) {
    return;
  }

  // Where the ray's height equals each triangle's plane, if that is inside the triangle.
  const bool even = ((i + j) & 1) == 0;
  const auto facets = facetsOf(even, corners(i, j));
  const double a0 = ray.origin.x - west;
  const double b0 = ray.origin.y - north;
  for (size_t f = 0; f < 2; ++f) {
    const Facet& facet = facets[f];
    const double above = ray.origin.z - (facet.base + facet.slopeA * a0 + facet.slopeB * b0);
    const double climb = ray.direction.z - (facet.slopeA * ray.direction.x + facet.slopeB * ray.direction.y);
    if (climb == 0.0) continue;
    const double distance = -above / climb;
    if (!(distance >= 0.0) || (best && distance >= best->distance)) continue;
    const double a = a0 + distance * ray.direction.x;
    const double b = b0 + distance * ray.direction.y;
    if (a < -kEdge || a > 1.0 + kEdge || b < -kEdge || b > 1.0 + kEdge) continue;
    const double side = sideOfDiagonal(even, a, b);
    if (f == 0 ? side < -kEdge : side > kEdge) continue;
    best = Hit{distance, glm::dvec3(0.0), climb < 0.0};
  }
}

std::array<double, 4> ReferenceSurface::corners(int64_t i, int64_t j) const {
  return {grid_.height(i, j), grid_.height(i + 1, j), grid_.height(i, j + 1), grid_.height(i + 1, j + 1)};
}

std::optional<double> ReferenceSurface::heightAt(glm::dvec2 place) const {
  const double x = place.x / grid_.spacingX;
  const double y = -place.y / grid_.spacingY;
  const auto lastI = static_cast<double>(grid_.cols - 2);
  const auto lastJ = static_cast<double>(grid_.rows - 2);
  constexpr double kNear = 1e-7;
  if (!(x >= -kNear && x <= lastI + 1.0 + kNear && y >= -kNear && y <= lastJ + 1.0 + kNear))
    return std::nullopt;

  // A place on the edge of a cell that is no ground may belong to its neighbour that is.
  for (const double stepY : {0.0, -kNear, kNear}) {
    for (const double stepX : {0.0, -kNear, kNear}) {
      const double i = std::clamp(std::floor(x + stepX), 0.0, lastI);
      const double j = std::clamp(std::floor(y + stepY), 0.0, lastJ);
      if (!grid_.isGround(static_cast<int64_t>(i), static_cast<int64_t>(j))) continue;
      const auto col = static_cast<int64_t>(i);
      const auto row = static_cast<int64_t>(j);
      return heightInCell((col + row) % 2 == 0, corners(col, row), std::clamp(x - i, 0.0, 1.0),
                          std::clamp(y - j, 0.0, 1.0));
    }
  }
  return std::nullopt;
}

bool ReferenceSurface::isAllGround(glm::dvec2 low, glm::dvec2 high) const {
  const double west = std::floor(low.x / grid_.spacingX);
  const double east = std::floor(high.x / grid_.spacingX);
  const double north = std::floor(-high.y / grid_.spacingY);
  const double south = std::floor(-low.y / grid_.spacingY);
  const auto lastI = static_cast<double>(grid_.cols - 2);
  const auto lastJ = static_cast<double>(grid_.rows - 2);
  if (!(west >= 0.0 && north >= 0.0 && east <= lastI && south <= lastJ)) return false;
  for (auto j = static_cast<int64_t>(north); j <= static_cast<int64_t>(south); ++j) {
    for (auto i = static_cast<int64_t>(west); i <= static_cast<int64_t>(east); ++i) {
      if (!grid_.isGround(i, j)) return false;
    }
  }
  return true;
}

ReferenceSurface::Cover::Cover(const ReferenceSurface& surface, int64_t marginCells)
    : surface_(surface), blockCells_(std::max<int64_t>(marginCells, 1)) {
  const ReferenceGrid& grid = surface.grid();
  cols_ = (grid.cols - 1 + blockCells_ - 1) / blockCells_;
  rows_ = (grid.rows - 1 + blockCells_ - 1) / blockCells_;

  // Blocks without a hole, then those whose neighbours have none either.
  std::vector<uint8_t> whole(static_cast<size_t>(cols_ * rows_), 1);
  for (int64_t j = 0; j < grid.rows - 1; ++j) {
    for (int64_t i = 0; i < grid.cols - 1; ++i) {
      if (!grid.isGround(i, j)) whole[static_cast<size_t>((j / blockCells_) * cols_ + i / blockCells_)] = 0;
    }
  }
  full_.assign(whole.size(), 0);
  for (int64_t row = 1; row + 1 < rows_; ++row) {
    for (int64_t col = 1; col + 1 < cols_; ++col) {
      uint8_t all = 1;
      for (int64_t dy = -1; dy <= 1; ++dy) {
        for (int64_t dx = -1; dx <= 1; ++dx) all &= whole[static_cast<size_t>((row + dy) * cols_ + col + dx)];
      }
      full_[static_cast<size_t>(row * cols_ + col)] = all;
    }
  }
}

bool ReferenceSurface::Cover::mustHit(glm::dvec3 origin, glm::dvec3 direction) const {
  if (!surface_.hasGround() || !(direction.z < 0.0) || !(origin.z > surface_.maxHeight())) return false;
  const Ray ray = surface_.toSamples(origin, direction);
  const double first = (surface_.maxHeight() - origin.z) / direction.z;
  const double last = (surface_.minHeight() - origin.z) / direction.z;

  // Walk the way over the ground in steps of at most half a block, neighbours of full blocks being full.
  const glm::dvec3 from = ray.origin + first * ray.direction;
  const glm::dvec3 to = ray.origin + last * ray.direction;
  const double length = std::max(std::abs(to.x - from.x), std::abs(to.y - from.y));
  const auto side = static_cast<double>(blockCells_);
  const double steps = std::ceil(2.0 * length / side) + 1.0;
  if (!(steps <= 4.0 * static_cast<double>(cols_ + rows_) + 8.0)) return false;
  for (double step = 0.0; step <= steps; step += 1.0) {
    const double u = step / steps;
    const double col = std::floor((from.x + u * (to.x - from.x)) / side);
    const double row = std::floor((from.y + u * (to.y - from.y)) / side);
    if (!(col >= 0.0 && row >= 0.0 && col < static_cast<double>(cols_) && row < static_cast<double>(rows_)))
      return false;
    if (full_[static_cast<size_t>(static_cast<int64_t>(row) * cols_ + static_cast<int64_t>(col))] == 0)
      return false;
  }
  return true;
}

}  // namespace terrane
