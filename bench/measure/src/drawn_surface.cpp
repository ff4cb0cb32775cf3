#include "terrane/measure/drawn_surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "terrane/base/check.h"
#include "terrane/lod/mesh_placement.h"

namespace terrane {

DrawnSurface::DrawnSurface(const Cut& cut, const Frame& frame, const ResidentTiles& tiles)
    : lattice_(cut.latticeDepth), cells_(cut.grid.cellsPerSide()) {
  const double finer = std::ldexp(1.0, cut.latticeDepth - frame.finestLevel);
  cellsPerMeter_ = {finer / frame.spacingXMeters(), finer / frame.spacingYMeters()};
  coarsestLevel_ = lattice_.deepestLevel();
  patches_.reserve(cut.patches.size());
  for (const Patch& patch : cut.patches) {
    const Tile* tile = tiles.find(patch.tile);
    TERRANE_CHECK(tile != nullptr, "tile {} is drawn and not resident", toString(patch.tile));
    DrawnPatch drawn;
    drawn.morph = patch.morph;
    if (cut.surface == SurfaceKind::Meshes)
      placeMesh(patch, tiles, drawn);
    else
      placeTemplate(patch, cut.grid, *tile, drawn);
    patches_.push_back(std::move(drawn));
    Halves& halves = byDiamond_[patch.triangle.diamond];
    halves.half[halves.count++] = {patch.triangle.apex, &patches_.back()};
    coarsestLevel_ = std::min(coarsestLevel_, patch.triangle.diamond.level);
    finestLevel_ = std::max(finestLevel_, patch.triangle.diamond.level);
  }
}

void DrawnSurface::placeTemplate(const Patch& patch, const PatchGrid& grid, const Tile& tile,
                                 DrawnPatch& drawn) const {
  drawn.place = placePatch(lattice_, grid, patch.triangle);
  drawn.rightAngle = patch.triangle.diamond.isQuadCenter();
  drawn.heights = tile.samples.heights.data();
  const int shift = lattice_.depth() - patch.tile.level;
  drawn.texel = {(drawn.place.origin.x >> shift) - patch.tile.col * kTileCells,
                 (drawn.place.origin.y >> shift) - patch.tile.row * kTileCells};
  drawn.texelUnit = drawn.place.unit >> shift;
}

void DrawnSurface::placeMesh(const Patch& patch, const ResidentTiles& tiles, DrawnPatch& drawn) const {
  const MeshPlacement at = meshPlacement(lattice_, patch.triangle, patch.tile);
  const MeshLevel* meshes = tiles.findMeshes(patch.tile, at.level);
  TERRANE_CHECK(meshes != nullptr, "mesh level {} of tile {} is drawn and not made", at.level,
                toString(patch.tile));
  drawn.mesh.emplace(*meshes, meshes->patches[static_cast<size_t>(at.index)]);
  drawn.cellsASample = std::ldexp(1.0, lattice_.depth() - patch.tile.level);
  drawn.tileOrigin = drawn.cellsASample * kTileCells * glm::dvec2(patch.tile.col, patch.tile.row);
}

const DrawnSurface::DrawnPatch* DrawnSurface::patchAt(glm::dvec2 cell) const {
  const double side = lattice_.side();
  if (!(cell.x >= 0.0 && cell.y >= 0.0 && cell.x <= side && cell.y <= side)) return nullptr;
  // Which of a diamond's two triangles, and which half of a triangle, is the one whose corner is nearer: they
  // are mirrored at the line between them.
  const auto squared = [&](LatticePoint p) {
    return (cell.x - p.x) * (cell.x - p.x) + (cell.y - p.y) * (cell.y - p.y);
  };
  const auto roots = lattice_.rootTriangles();
  Triangle t = roots.items[0];
  if (squared(roots.items[1].apex) < squared(t.apex)) t = roots.items[1];
  for (;;) {
    if (t.diamond.level >= coarsestLevel_) {
      if (const auto at = byDiamond_.find(t.diamond); at != byDiamond_.end())
        for (int i = 0; i < at->second.count; ++i)
          if (at->second.half[i].first == t.apex) return at->second.half[i].second;
    }
    if (t.diamond.level >= finestLevel_) return nullptr;
    const auto ends = lattice_.hypotenuse(t.diamond);
    const LatticePoint end = squared(ends[0]) <= squared(ends[1]) ? ends[0] : ends[1];
    t = {{(t.apex.x + end.x) / 2, (t.apex.y + end.y) / 2, t.diamond.level + 1}, t.diamond.center()};
  }
}

float DrawnSurface::sample(const DrawnPatch& patch, LatticePoint vertex) const {
  const LatticePoint turned = rotateQuarters(vertex, patch.place.rotation);
  const int x = patch.texel.x + turned.x * patch.texelUnit, y = patch.texel.y + turned.y * patch.texelUnit;
  return patch.heights[y * kTileSamples + x];
}

float DrawnSurface::vertexHeight(const DrawnPatch& patch, LatticePoint grid) const {
  // note: says again what shaders/morph.glsl says; benches hold what is drawn against it.
  const LatticePoint v = patch.rightAngle ? grid : LatticePoint{grid.x + grid.y, grid.x - grid.y};
  const float own = sample(patch, v);
  const bool isNew = ((patch.rightAngle ? v.x + v.y : v.x) & 1) != 0;
  if (!isNew || patch.morph >= 1.0F) return own;
  LatticePoint toEnd;
  if (patch.rightAngle)
    toEnd = (v.x & 1) != 0 ? LatticePoint{1, 0} : LatticePoint{0, 1};
  else
    toEnd = (((v.x + v.y) >> 1) & 1) != 0 ? LatticePoint{1, 1} : LatticePoint{1, -1};
  const float coarse =
      0.5F * (sample(patch, {v.x - toEnd.x, v.y - toEnd.y}) + sample(patch, {v.x + toEnd.x, v.y + toEnd.y}));
  return coarse + patch.morph * (own - coarse);
}

double DrawnSurface::heightIn(const DrawnPatch& patch, glm::dvec2 cell) const {
  if (patch.mesh) return patch.mesh->heightAt((cell - patch.tileOrigin) / patch.cellsASample, patch.morph);
  // In the template, then in the grid whose axes are the right angle's legs.
  const double unit = patch.place.unit;
  const glm::dvec2 offset{(cell.x - patch.place.origin.x) / unit, (cell.y - patch.place.origin.y) / unit};
  glm::dvec2 grid = offset;
  switch (patch.place.rotation & 3) {
    case 1:
      grid = {offset.y, -offset.x};
      break;
    case 2:
      grid = -offset;
      break;
    case 3:
      grid = {-offset.y, offset.x};
      break;
    default:
      break;
  }
  if (!patch.rightAngle) grid = {0.5 * (grid.x + grid.y), 0.5 * (grid.x - grid.y)};

  // The cell and its triangle; on the patch's own border roundings must not lead out of it.
  const double n = cells_;
  int x = static_cast<int>(std::clamp(std::floor(grid.x), 0.0, n - 1.0));
  int y = static_cast<int>(std::clamp(std::floor(grid.y), 0.0, n - 1.0));
  if (patch.rightAngle && x + y > cells_ - 1) x = std::max(0, cells_ - 1 - y);
  if (!patch.rightAngle) y = std::min(x, y);
  const double u = std::clamp(grid.x - x, 0.0, 1.0), v = std::clamp(grid.y - y, 0.0, 1.0);
  const auto h = [&](int dx, int dy) { return static_cast<double>(vertexHeight(patch, {x + dx, y + dy})); };
  if ((x + y) % 2 == 0) {
    // note: on the right angle's hypotenuse, and at the other template's leg, half of a cell is outside.
    const bool first = !patch.rightAngle && x == y ? true : u >= v;
    if (first) {
      const double h10 = h(1, 0);
      return h(0, 0) + u * (h10 - h(0, 0)) + std::min(u, v) * (h(1, 1) - h10);
    }
    const double h01 = h(0, 1);
    return h(0, 0) + v * (h01 - h(0, 0)) + u * (h(1, 1) - h01);
  }
  const bool last = patch.rightAngle && x + y == cells_ - 1;
  if (u + v <= 1.0 || last) {
    const double h00 = h(0, 0);
    return h00 + u * (h(1, 0) - h00) + v * (h(0, 1) - h00);
  }
  const double h11 = h(1, 1);
  return h11 + (1.0 - u) * (h(0, 1) - h11) + (1.0 - v) * (h(1, 0) - h11);
}

std::optional<double> DrawnSurface::heightAt(glm::dvec2 local) const {
  const glm::dvec2 cell{local.x * cellsPerMeter_.x, -local.y * cellsPerMeter_.y};
  const DrawnPatch* patch = patchAt(cell);
  if (patch == nullptr) return std::nullopt;
  return heightIn(*patch, cell);
}

}  // namespace terrane
