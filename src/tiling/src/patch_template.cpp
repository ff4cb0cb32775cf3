#include "terrane/tiling/patch_template.h"

#include <map>

namespace terrane {

namespace {

struct TemplateBuilder {
  PatchTemplate out;
  std::map<LatticePoint, uint16_t> indexOf;

  uint16_t index(LatticePoint p) {
    const auto [at, isNew] = indexOf.try_emplace(p, static_cast<uint16_t>(out.vertices.size()));
    if (isNew) out.vertices.push_back(p);
    return at->second;
  }

  /// Bisects `levels` times the triangle with the given apex and hypotenuse; apex, left, right turn from x
  /// towards y.
  void bisect(LatticePoint apex, LatticePoint left, LatticePoint right, int levels) {
    if (levels == 0) {
      for (const LatticePoint p : {apex, left, right}) out.indices.push_back(index(p));
      return;
    }
    const LatticePoint middle{(left.x + right.x) / 2, (left.y + right.y) / 2};
    bisect(middle, apex, left, levels - 1);
    bisect(middle, right, apex, levels - 1);
  }
};

}  // namespace

PatchTemplate makeRightAngleTemplate(const PatchGrid& grid) {
  const int32_t cells = grid.cellsPerSide();
  TemplateBuilder builder;
  builder.bisect({0, 0}, {cells, 0}, {0, cells}, 2 * grid.k);
  return std::move(builder.out);
}

PatchTemplate makeHypotenuseTemplate(const PatchGrid& grid) {
  const int32_t cells = grid.cellsPerSide();
  TemplateBuilder builder;
  builder.bisect({cells, cells}, {0, 0}, {2 * cells, 0}, 2 * grid.k);
  return std::move(builder.out);
}

}  // namespace terrane
