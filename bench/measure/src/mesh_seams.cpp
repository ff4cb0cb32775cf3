#include "terrane/measure/mesh_seams.h"

#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include "terrane/base/bit_cast.h"
#include "terrane/base/check.h"
#include "terrane/lod/mesh_placement.h"

namespace terrane {

namespace {

using Side = std::array<LatticePoint, 2>;

struct SideVertex {
  LatticePoint place;
  uint32_t heightBits = 0;
  friend bool operator==(const SideVertex&, const SideVertex&) = default;
  friend auto operator<=>(const SideVertex&, const SideVertex&) = default;
};

Side sideBetween(LatticePoint a, LatticePoint b) {
  return a < b ? Side{a, b} : Side{b, a};
}

bool isBetween(const Side& side, LatticePoint p) {
  const int64_t dx = int64_t{side[1].x} - side[0].x, dy = int64_t{side[1].y} - side[0].y;
  const int64_t px = int64_t{p.x} - side[0].x, py = int64_t{p.y} - side[0].y;
  return dx * py == dy * px && std::min(side[0].x, side[1].x) <= p.x &&
         p.x <= std::max(side[0].x, side[1].x) && std::min(side[0].y, side[1].y) <= p.y &&
         p.y <= std::max(side[0].y, side[1].y);
}

/// shaders/mesh_patch.glsl, meshHeight().
float drawnHeight(const PatchVertex& v, float morph) {
  return morph >= 1.0F ? v.heightMeters : v.coarseMeters + morph * (v.heightMeters - v.coarseMeters);
}

}  // namespace

MeshSeams measureMeshSeams(const Cut& cut, const ResidentTiles& tiles) {
  const Lattice lattice(cut.latticeDepth);
  std::map<Side, std::vector<std::vector<SideVertex>>> sides;
  std::vector<Patch> all = cut.patches;
  all.insert(all.end(), cut.hidden.begin(), cut.hidden.end());
  for (const Patch& patch : all) {
    const MeshPlacement at = meshPlacement(lattice, patch.triangle, patch.tile);
    const MeshLevel* meshes = tiles.findMeshes(patch.tile, at.level);
    TERRANE_CHECK(meshes != nullptr, "level {} of tile {} is not made", at.level, toString(patch.tile));
    const MeshLevel::Patch& mesh = meshes->patches[static_cast<size_t>(at.index)];
    const int shift = cut.latticeDepth - patch.tile.level;
    const auto ends = lattice.hypotenuse(patch.triangle.diamond);
    for (const Side& side : {sideBetween(ends[0], ends[1]), sideBetween(ends[0], patch.triangle.apex),
                             sideBetween(ends[1], patch.triangle.apex)}) {
      std::vector<SideVertex> found;
      for (uint32_t i = 0; i < mesh.vertexCount; ++i) {
        const PatchVertex& v = meshes->vertices[mesh.firstVertex + i];
        const LatticePoint place{(patch.tile.col * kTileCells + v.x()) << shift,
                                 (patch.tile.row * kTileCells + v.y()) << shift};
        if (isBetween(side, place)) found.push_back({place, bitCast<uint32_t>(drawnHeight(v, patch.morph))});
      }
      std::sort(found.begin(), found.end());
      sides[side].push_back(std::move(found));
    }
  }

  MeshSeams out;
  for (const auto& [side, patches] : sides) {
    const LatticePoint middle{(side[0].x + side[1].x) / 2, (side[0].y + side[1].y) / 2};
    if (sides.count(sideBetween(side[0], middle)) != 0 && middle != side[0]) ++out.unlike;
    if (patches.size() < 2) continue;
    ++out.sides;
    out.vertices += static_cast<int64_t>(patches[0].size());
    if (patches.size() > 2 || patches[0] != patches[1]) ++out.gaping;
  }
  return out;
}

}  // namespace terrane
