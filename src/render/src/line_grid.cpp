#include "line_grid.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

namespace terrane {
namespace {

/// Cells of the finest level that all lines together may cross, about: what a place's list holds there is
/// short enough, and tables stay within some megabytes.
constexpr double kMostCrossings = 65536.0;
constexpr double kLeastCellMeters = 8.0;
/// The coarsest level's cells are as large as that: a pixel that covers more sees no more of the earth.
constexpr double kLargestCellMeters = 4e6;
/// Cells' columns and rows stay integers of 32 bits.
constexpr double kMostMeters = 1e8;
/// The share of a cell that lines may be off on its level.
constexpr double kSimplification = 1.0 / 512.0;

bool isOnEarth(glm::dvec2 p) {
  return std::abs(p.x) < kMostMeters && std::abs(p.y) < kMostMeters;
}

double distanceToSegment(glm::dvec2 p, glm::dvec2 a, glm::dvec2 b) {
  const glm::dvec2 along = b - a;
  const double square = glm::dot(along, along);
  const double t = square > 0.0 ? std::clamp(glm::dot(p - a, along) / square, 0.0, 1.0) : 0.0;
  return glm::length(p - a - t * along);
}

/// Douglas and Peucker: the corners that must stay so that no other is farther off than `tolerance`.
std::vector<glm::dvec2> simplified(const std::vector<glm::dvec2>& corners, double tolerance) {
  if (corners.size() < 3) return corners;
  std::vector<bool> stays(corners.size(), false);
  stays.front() = stays.back() = true;
  std::vector<std::pair<size_t, size_t>> parts = {{0, corners.size() - 1}};
  while (!parts.empty()) {
    const auto [first, last] = parts.back();
    parts.pop_back();
    double most = tolerance;
    size_t split = first;
    for (size_t i = first + 1; i < last; ++i)
      if (const double off = distanceToSegment(corners[i], corners[first], corners[last]); off > most)
        most = off, split = i;
    if (split == first) continue;
    stays[split] = true;
    parts.push_back({first, split});
    parts.push_back({split, last});
  }
  std::vector<glm::dvec2> out;
  for (size_t i = 0; i < corners.size(); ++i)
    if (stays[i]) out.push_back(corners[i]);
  return out;
}

/// The part of a segment within `half` of a middle, both ways; false where there is none.
bool clipToSquare(glm::dvec2& a, glm::dvec2& b, glm::dvec2 middle, double half) {
  double begin = 0.0, end = 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    const double from = a[axis] - middle[axis], step = b[axis] - a[axis];
    if (step == 0.0) {
      if (std::abs(from) > half) return false;
      continue;
    }
    const double t0 = (-half - from) / step, t1 = (half - from) / step;
    begin = std::max(begin, std::min(t0, t1));
    end = std::min(end, std::max(t0, t1));
  }
  if (begin > end) return false;
  const glm::dvec2 from = a, step = b - a;
  a = from + begin * step;
  b = from + end * step;
  return true;
}

int32_t packed(glm::dvec2 p, double quantum) {
  const auto part = [&](double v) {
    return static_cast<uint32_t>(
        static_cast<uint16_t>(static_cast<int16_t>(std::clamp(std::round(v / quantum), -32767.0, 32767.0))));
  };
  return static_cast<int32_t>(part(p.x) | part(p.y) << 16);
}

/// Collects lists, cell by cell.
class Lister {
 public:
  explicit Lister(LineGrid& grid) : grid_(grid) { grid.slots.assign(1024, LineCell{}); }

  /// Puts a segment into all cells of a level that it is near. Later lines must be put first.
  void add(glm::dvec2 a, glm::dvec2 b, int32_t line, double halfWidthMeters, int level) {
    const double cell = grid_.cellMeters(level);
    const double reach = 0.5 * cell + halfWidthMeters;
    const auto index = [&](double v) { return static_cast<int32_t>(std::floor(v / cell)); };
    const int32_t lastRow = index(std::max(a.y, b.y) + reach);
    for (int32_t row = index(std::min(a.y, b.y) - reach); row <= lastRow; ++row) {
      // The part of the segment that is near the row of cells tells which cells of it.
      double west = std::min(a.x, b.x), east = std::max(a.x, b.x);
      if (a.y != b.y) {
        const double low = (row * cell - reach - a.y) / (b.y - a.y),
                     high = ((row + 1) * cell + reach - a.y) / (b.y - a.y);
        const double begin = std::max(std::min(low, high), 0.0), end = std::min(std::max(low, high), 1.0);
        if (begin > end) continue;
        const double x0 = a.x + begin * (b.x - a.x), x1 = a.x + end * (b.x - a.x);
        west = std::min(x0, x1);
        east = std::max(x0, x1);
      }
      const int32_t lastCol = index(east + reach);
      for (int32_t col = index(west - reach); col <= lastCol; ++col) put(a, b, line, reach, level, col, row);
    }
  }

  /// Lays the lists one after the other.
  void finish() {
    std::vector<int32_t> next(static_cast<size_t>(cells_), 0);
    int32_t first = 0;
    for (LineCell& slot : grid_.slots) {
      if (slot[3] == 0) continue;
      next[static_cast<size_t>(slot[2])] = first;
      slot[2] = std::exchange(first, first + (slot[3] & LineGrid::kMostCellLines));
    }
    grid_.entries.resize(static_cast<size_t>(first));
    for (const Placed& placed : placed_)
      grid_.entries[static_cast<size_t>(next[static_cast<size_t>(placed.cell)]++)] = placed.entry;
  }

 private:
  struct Placed {
    int32_t cell;  ///< in the order of their coming
    LineEntry entry;
  };

  void put(glm::dvec2 a, glm::dvec2 b, int32_t line, double reach, int level, int32_t col, int32_t row) {
    const double cell = grid_.cellMeters(level);
    const glm::dvec2 middle((col + 0.5) * cell, (row + 0.5) * cell);
    // note: cut somewhat farther out than anything counts, so that cut ends are not seen.
    if (!clipToSquare(a, b, middle, 0.5 * cell + reach + 0.1 * cell)) return;
    LineCell& slot = slotOf(col, row, level);
    if ((slot[3] & LineGrid::kMostCellLines) == LineGrid::kMostList) return;
    ++slot[3];
    const double quantum = grid_.quantumMeters(level);
    placed_.push_back({slot[2], {packed(a - middle, quantum), packed(b - middle, quantum), line, 0}});
  }

  LineCell& slotOf(int32_t col, int32_t row, int32_t level) {
    if (2 * static_cast<size_t>(cells_ + 1) > grid_.slots.size()) {
      std::vector<LineCell> before(2 * grid_.slots.size(), LineCell{});
      std::swap(before, grid_.slots);
      for (const LineCell& slot : before)
        if (slot[3] != 0) search(slot[0], slot[1], slot[3] >> 20) = slot;
    }
    LineCell& slot = search(col, row, level);
    if (slot[3] == 0) slot = {col, row, cells_++, level << 20};
    return slot;
  }
  LineCell& search(int32_t col, int32_t row, int32_t level) {
    for (uint32_t at = LineGrid::hash(col, row, level);; ++at) {
      LineCell& slot = grid_.slots[at & (grid_.slots.size() - 1)];
      if (slot[3] == 0 || (slot[0] == col && slot[1] == row && slot[3] >> 20 == level)) return slot;
    }
  }

  LineGrid& grid_;
  int32_t cells_ = 0;
  std::vector<Placed> placed_;
};

}  // namespace

uint32_t LineGrid::hash(int32_t col, int32_t row, int32_t level) {
  uint32_t h = static_cast<uint32_t>(col) * 73856093U ^ static_cast<uint32_t>(row) * 19349663U ^
               static_cast<uint32_t>(level) * 83492791U;
  h ^= h >> 16;
  h *= 0x45d9f3bU;
  return h ^ h >> 16;
}

std::span<const LineEntry> LineGrid::find(int32_t col, int32_t row, int32_t level) const {
  if (slots.empty()) return {};
  for (uint32_t at = hash(col, row, level);; ++at) {
    const LineCell& slot = slots[at & (slots.size() - 1)];
    const int32_t count = slot[3] & kMostCellLines;
    if (count == 0) return {};
    if (slot[0] == col && slot[1] == row && slot[3] >> 20 == level)
      return {entries.data() + slot[2], static_cast<size_t>(count)};
  }
}

LineGrid makeLineGrid(std::span<const GroundLine> lines) {
  LineGrid out;
  bool isEmpty = true;
  double length = 0.0;
  std::vector<std::vector<glm::dvec2>> corners;
  for (const GroundLine& line : lines) {
    auto& kept = corners.emplace_back();
    for (const glm::dvec2 corner : line.corners) {
      if (!isOnEarth(corner)) continue;
      if (!kept.empty()) length += glm::length(corner - kept.back());
      kept.push_back(corner);
    }
    if (kept.empty()) continue;
    isEmpty = false;
    double& reach = line.isWidthInMeters ? out.reachMeters : out.reachPixels;
    reach = std::max(reach, 0.5 * line.width);
  }
  if (isEmpty) return out;

  // From cells that lines do not cross too often up to one that sees all of them from wherever.
  out.finestCellMeters = std::exp2(
      std::ceil(std::log2(std::max({kLeastCellMeters, length / kMostCrossings, out.reachMeters / 4.0}))));
  out.levels = 1;
  while (out.levels < LineGrid::kMostLevels && out.cellMeters(out.levels - 1) < kLargestCellMeters)
    ++out.levels;
  Lister lister(out);
  for (int level = 0; level < out.levels; ++level) {
    for (size_t i = corners.size(); i-- > 0;) {
      // What is left of the level before is enough for the next.
      std::vector<glm::dvec2>& line = corners[i];
      line = simplified(line, kSimplification * out.cellMeters(level) * 0.5);
      const double half = lines[i].isWidthInMeters ? 0.5 * lines[i].width : 0.0;
      if (line.size() == 1) lister.add(line[0], line[0], static_cast<int32_t>(i), half, level);
      for (size_t k = 0; k + 1 < line.size(); ++k)
        lister.add(line[k], line[k + 1], static_cast<int32_t>(i), half, level);
    }
  }
  lister.finish();
  return out;
}

}  // namespace terrane
