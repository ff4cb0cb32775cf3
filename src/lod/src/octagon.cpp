#include "terrane/lod/octagon.h"

#include <algorithm>
#include <cmath>

namespace terrane {

double Octagon::support(glm::dvec2 n) const {
  const double x = std::abs(n.x), y = std::abs(n.y);
  return extent * std::max(x, y) + inner() * std::min(x, y);
}

double Octagon::distance(glm::dvec2 offset) const {
  // By symmetry only the sector below the diagonal of the first quadrant matters.
  const double far = std::max(std::abs(offset.x), std::abs(offset.y));
  const double near = std::min(std::abs(offset.x), std::abs(offset.y));
  if (near <= inner()) return std::max(0.0, far - extent);
  if (far - extent >= near - inner()) {
    const double x = far - extent, y = near - inner();
    return std::sqrt(x * x + y * y);
  }
  return std::max(0.0, (far + near - sum) / std::sqrt(2.0));
}

NestedOctagons::NestedOctagons(const Lattice& lattice, int deepestLevel) {
  const auto levels = static_cast<size_t>(deepestLevel + 1);
  nested_.resize(levels);
  own_.resize(levels);
  for (int level = deepestLevel; level >= 0; --level) {
    const double s = static_cast<double>(lattice.side()) / std::ldexp(1.0, level / 2 + 1);
    const bool quadCenter = level % 2 == 0;
    // A quad-centre's triangles fill its square, an edge-centre's the square turned by 45 degrees.
    const Octagon own = quadCenter ? Octagon{s, 2.0 * s} : Octagon{s, s};
    Octagon all = own;
    if (level < deepestLevel) {
      // Children sit at (+-s, 0), (0, +-s) of a quad-centre, at (+-s/2, +-s/2) of an edge-centre.
      const Octagon& child = nested_[static_cast<size_t>(level + 1)];
      const double reach = quadCenter ? s : 0.5 * s;
      const double reachSum = s;
      all.extent = std::max(all.extent, reach + child.extent);
      all.sum = std::max(all.sum, reachSum + child.sum);
    }
    nested_[static_cast<size_t>(level)] = all;
    own_[static_cast<size_t>(level)] = own;
  }
}

}  // namespace terrane
