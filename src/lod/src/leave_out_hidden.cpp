#include "leave_out_hidden.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "horizon.h"
#include "terrane/base/bit_cast.h"

namespace terrane {

namespace {

/// Nothing nearer is looked at, metres.
constexpr double kNearest = 1.0;

/// A tile's grid as the horizon sees it.
struct Grid {
  TileId tile{-1, 0, 0};
  glm::dvec2 origin{0.0}, alongX{0.0}, alongY{0.0};  ///< to the right and ahead; steps of a cell
  bool isClosed = false;                             ///< is nothing of it left open?
  glm::dvec2 at(int x, int y) const {
    return origin + static_cast<double>(x) * alongX + static_cast<double>(y) * alongY;
  }
};

class HiddenPatches {
 public:
  HiddenPatches(Cut& cut, const PatchSelection& selection, const Camera& camera, glm::dvec2 cellMeters,
                const ResidentTiles& tiles)
      : cut_(cut),
        exaggeration_(selection.exaggeration),
        eyeHeight_(camera.eyeLocal.z),
        cellMeters_(cellMeters),
        tiles_(tiles),
        horizon_(camera) {}

  void run() {
    if (!horizon_.isLevel()) return;
    seen_.reserve(cut_.patches.size());
    for (const Patch& patch : cut_.patches) look(patch);
    // From near to far: a patch is held against those that end before it begins.
    size_t left = seen_.size();
    for (const uint32_t event : inOrder()) {
      Seen& seen = seen_[event / 2];
      if (event % 2 == 0) {
        seen.isHidden = isHidden(seen);
        --left;
      } else if (!seen.isHidden && grids_[seen.grid].isClosed && left > seen_.size() / 16) {
        add(seen);  // note: the farthest hide hardly anything
      }
    }
    size_t kept = 0;
    for (size_t i = 0; i < seen_.size(); ++i) {
      if (seen_[i].isHidden)
        cut_.hidden.push_back(cut_.patches[i]);
      else
        cut_.patches[kept++] = cut_.patches[i];
    }
    cut_.patches.resize(kept);
  }

 private:
  struct Seen {
    PatchOutline outline;
    uint32_t grid;         ///< of grids_
    const uint8_t* codes;  ///< of its relief; null: may be anywhere
    MeshRelief::Range range;
    int step, level;
    double nearest, farthest;  ///< ahead
    bool isHidden = false;
  };

  void look(const Patch& patch) {
    if (grids_.empty() || !(patch.tile == grids_.back().tile) || meshLevel_ != patch.mesh.level ||
        !(patch.shadingTile == shading_)) {
      addGrid(patch);
      meshLevel_ = patch.mesh.level;
      shading_ = patch.shadingTile;
      meshes_ = tiles_.findMeshes(patch.tile, patch.mesh.level);
    }
    const Grid& grid = grids_.back();
    const bool falls = meshes_ != nullptr && meshes_->centerFalls;
    const PatchCorners corners = patchCorners(patch.mesh.level, patch.mesh.index, falls);
    Seen out{PatchOutline(corners),
             static_cast<uint32_t>(grids_.size() - 1),
             nullptr,
             {},
             1,
             patch.mesh.level,
             0.0,
             0.0};
    if (meshes_ != nullptr) {
      const auto index = static_cast<size_t>(patch.mesh.index);
      out.step = meshes_->relief.step;
      out.range = meshes_->relief.ranges[index];
      out.codes = meshes_->relief.codes.data() +
                  index * static_cast<size_t>(reliefCounts(patch.mesh.level, out.outline).all());
    }
    const auto aheadOf = [&](const std::array<int, 2>& corner) { return grid.at(corner[0], corner[1]).y; };
    const double a = aheadOf(corners.ends[0]), b = aheadOf(corners.ends[1]), c = aheadOf(corners.apex);
    out.nearest = std::min({a, b, c});
    out.farthest = std::max({a, b, c});
    seen_.push_back(out);
  }
  void addGrid(const Patch& patch) {
    Grid grid;
    const TileId id = patch.tile;
    const double cells = std::ldexp(1.0, cut_.latticeDepth - id.level);
    const glm::dvec2 cell = cells * cellMeters_;
    grid.tile = id;
    grid.origin = horizon_.place({id.col * kTileCells * cell.x, -id.row * kTileCells * cell.y});
    grid.alongX = horizon_.step({cell.x, 0.0});
    grid.alongY = horizon_.step({0.0, -cell.y});
    // Ground without holes: what is shown of it is decided by the shading tile.
    const Tile* shading = tiles_.find(patch.shadingTile);
    grid.isClosed = shading != nullptr && shading->samples.coverage.kind == Coverage::Kind::Full;
    grids_.push_back(grid);
  }

  /// Two events a patch: where it begins (even) and where it ends (odd). Sorted by depth in steps of 1.6 %,
  /// ends rounded up.
  std::vector<uint32_t> inOrder() const {
    constexpr int kBits = 17;
    const auto stepOf = [](double depth) {
      return bitCast<uint32_t>(static_cast<float>(std::max(depth, kNearest))) >> kBits;
    };
    std::vector<uint32_t> steps(2 * seen_.size());
    uint32_t least = std::numeric_limits<uint32_t>::max(), most = 0;
    for (size_t i = 0; i < seen_.size(); ++i) {
      steps[2 * i] = stepOf(seen_[i].nearest);
      steps[2 * i + 1] = stepOf(seen_[i].farthest) + 1;
      least = std::min(least, steps[2 * i]);
      most = std::max(most, steps[2 * i + 1]);
    }
    if (seen_.empty()) return {};
    // Of one step the ends come first.
    std::vector<uint32_t> begins(2 * size_t{most - least + 1} + 1, 0);
    const auto binOf = [&](size_t event) {
      return 2 * size_t{steps[event] - least} + (event % 2 == 0 ? 1 : 0);
    };
    for (size_t event = 0; event < steps.size(); ++event) ++begins[binOf(event) + 1];
    for (size_t bin = 1; bin < begins.size(); ++bin) begins[bin] += begins[bin - 1];
    std::vector<uint32_t> out(steps.size());
    for (size_t event = 0; event < steps.size(); ++event)
      out[begins[binOf(event)]++] = static_cast<uint32_t>(event);
    return out;
  }

  double aboveEye(float height) const { return static_cast<double>(height) * exaggeration_ - eyeHeight_; }

  /// As many squares as lie along a patch at most.
  static constexpr size_t kMostSquares = 8;
  using Point = Horizon::Point;
  using Points = std::array<Point, kMostSquares + 1>;
  /// Those at the ends of so many squares' sides; false where one is too near.
  bool findPoints(glm::dvec2 from, glm::dvec2 step, int count, Points& out) const {
    for (int i = 0; i <= count; ++i, from += step) {
      if (from.y < kNearest) return false;
      const double oneOverAhead = 1.0 / from.y;
      out[static_cast<size_t>(i)] = {horizon_.across(from.x, oneOverAhead), oneOverAhead};
    }
    return true;
  }

  /// Is every square that the patch has a part in below the horizon?
  bool isHidden(const Seen& seen) {
    if (seen.codes == nullptr || seen.nearest < kNearest) return false;
    const PatchOutline& outline = seen.outline;
    const Grid& grid = grids_[seen.grid];
    const int step = seen.step;
    const glm::dvec2 along = static_cast<double>(step) * grid.alongX;
    const int count = (outline.right - outline.left) / step;
    const uint8_t* code = seen.codes;
    Points rows[2];
    if (!findPoints(grid.at(outline.left, outline.top), along, count, rows[0])) return false;
    bool isOdd = false;
    for (int y = outline.top; y < outline.bottom; y += step, isOdd = !isOdd) {
      const Points &above = rows[isOdd ? 1 : 0], &below = rows[isOdd ? 0 : 1];
      if (!findPoints(grid.at(outline.left, y + step), along, count, rows[isOdd ? 0 : 1])) return false;
      const auto [from, to] = outline.inRows(y, step);
      auto at = static_cast<size_t>((from - outline.left) / step);
      for (int x = from; x < to; x += step, ++at, ++code)
        if (!isSquareHidden(above, below, at, seen.range.height(*code))) return false;
    }
    return true;
  }
  bool isSquareHidden(const Points& above, const Points& below, size_t at, float topMeters) const {
    const std::array<Point, 4> points = {above[at], above[at + 1], below[at], below[at + 1]};
    double first = points[0].across, last = first, near = points[0].oneOverAhead, far = near;
    for (size_t i = 1; i < points.size(); ++i) {
      first = std::min(first, points[i].across);
      last = std::max(last, points[i].across);
      near = std::max(near, points[i].oneOverAhead);
      far = std::min(far, points[i].oneOverAhead);
    }
    const double height = aboveEye(topMeters);
    return horizon_.hides(first, last, height * (height > 0.0 ? near : far));
  }

  /// Raises the horizon to a patch that is seen: along rows or columns, whichever lie more across the view.
  void add(const Seen& seen) {
    if (seen.codes == nullptr || seen.farthest < kNearest) return;
    const PatchOutline& outline = seen.outline;
    const Grid& grid = grids_[seen.grid];
    const int step = seen.step;
    const glm::dvec2 middle = grid.at((outline.left + outline.right) / 2, (outline.top + outline.bottom) / 2);
    const auto turn = [&](glm::dvec2 along) { return std::abs(along.x * middle.y - along.y * middle.x); };
    const ReliefCounts counts = reliefCounts(seen.level, outline);
    // Every other line does; the last one is the neighbour's first.
    if (turn(grid.alongX) >= turn(grid.alongY)) {
      const uint8_t* code = seen.codes + counts.squares;
      bool isTaken = true;
      for (int y = outline.top; y < outline.bottom; y += step, isTaken = !isTaken) {
        const auto [from, to] = outline.onRow(y);
        const int count = (to - from) / step;
        if (isTaken) raise(seen, grid.at(from, y), grid.alongX, count, code);
        code += count;
      }
    } else {
      const uint8_t* code = seen.codes + counts.squares + counts.onRows;
      bool isTaken = true;
      for (int x = outline.left; x < outline.right; x += step, isTaken = !isTaken) {
        const auto [from, to] = outline.onColumn(x);
        const int count = (to - from) / step;
        if (isTaken) raise(seen, grid.at(x, from), grid.alongY, count, code);
        code += count;
      }
    }
  }
  void raise(const Seen& seen, glm::dvec2 from, glm::dvec2 alongCell, int count, const uint8_t* code) {
    Points points;
    if (count == 0 || !findPoints(from, static_cast<double>(seen.step) * alongCell, count, points)) return;
    std::array<float, kMostSquares> heights;
    for (size_t i = 0; i < static_cast<size_t>(count); ++i)
      heights[i] = static_cast<float>(aboveEye(seen.range.height(code[i])));
    horizon_.raise(std::span(points).first(static_cast<size_t>(count) + 1),
                   std::span(heights).first(static_cast<size_t>(count)));
  }

  Cut& cut_;
  double exaggeration_;
  double eyeHeight_;
  glm::dvec2 cellMeters_;
  const ResidentTiles& tiles_;
  Horizon horizon_;
  std::vector<Seen> seen_;
  std::vector<Grid> grids_;
  int meshLevel_ = -1;  ///< of the patch before, like what follows
  TileId shading_{-1, 0, 0};
  const MeshLevel* meshes_ = nullptr;
};

}  // namespace

void leaveOutHidden(Cut& cut, const PatchSelection& selection, const Camera& camera, glm::dvec2 cellMeters,
                    const ResidentTiles& tiles) {
  HiddenPatches(cut, selection, camera, cellMeters, tiles).run();
}

}  // namespace terrane
