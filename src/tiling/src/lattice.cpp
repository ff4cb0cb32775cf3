#include "terrane/tiling/lattice.h"

#include <bit>

#include "terrane/base/check.h"

namespace terrane {

namespace {

/// Does the hypotenuse of a quad-centre run from north-west to south-east? Diagonals alternate like the
/// fields of a checkerboard: they join the corners whose coordinates, in sides of the square, sum up even.
/// note: the half-size is a power of two, its multiples are told by one of their bits.
bool hypotenuseFallsEastward(const Diamond& d, int32_t s) {
  return (((d.x - s) ^ (d.y - s)) & (2 * s)) == 0;
}

bool onHorizontalEdge(const Diamond& d, int32_t s) {
  return (d.x & s) != 0;
}

}  // namespace

Diamond Lattice::diamondAt(LatticePoint p) const {
  TERRANE_CHECK(contains(p), "({}, {}) is outside the world", p.x, p.y);
  // The half-size is the largest power of two that divides both coordinates.
  const auto bits = static_cast<uint32_t>(p.x) | static_cast<uint32_t>(p.y);
  const int32_t s = static_cast<int32_t>(bits & (~bits + 1));
  TERRANE_CHECK(s > 0 && s < side(), "({}, {}) is a corner of the world", p.x, p.y);
  const bool quadCenter = ((p.x / s) & 1) != 0 && ((p.y / s) & 1) != 0;
  const int halvings =
      std::countr_zero(static_cast<uint32_t>(side())) - std::countr_zero(static_cast<uint32_t>(s));
  return {p.x, p.y, 2 * (halvings - 1) + (quadCenter ? 0 : 1)};
}

std::array<LatticePoint, 2> Lattice::hypotenuse(const Diamond& d) const {
  const int32_t s = halfSize(d.level);
  if (d.isQuadCenter()) {
    if (hypotenuseFallsEastward(d, s)) return {{{d.x - s, d.y - s}, {d.x + s, d.y + s}}};
    return {{{d.x + s, d.y - s}, {d.x - s, d.y + s}}};
  }
  if (onHorizontalEdge(d, s)) return {{{d.x - s, d.y}, {d.x + s, d.y}}};
  return {{{d.x, d.y - s}, {d.x, d.y + s}}};
}

UpToFour<LatticePoint> Lattice::apexes(const Diamond& d) const {
  const int32_t s = halfSize(d.level);
  std::array<LatticePoint, 2> both;
  if (d.isQuadCenter()) {
    if (hypotenuseFallsEastward(d, s))
      both = {{{d.x + s, d.y - s}, {d.x - s, d.y + s}}};
    else
      both = {{{d.x - s, d.y - s}, {d.x + s, d.y + s}}};
  } else if (onHorizontalEdge(d, s)) {
    both = {{{d.x, d.y - s}, {d.x, d.y + s}}};
  } else {
    both = {{{d.x - s, d.y}, {d.x + s, d.y}}};
  }
  UpToFour<LatticePoint> out;
  for (const LatticePoint& p : both)
    if (contains(p)) out.add(p);
  return out;
}

UpToFour<Diamond> Lattice::parents(const Diamond& d) const {
  UpToFour<Diamond> out;
  if (d.level == 0) return out;
  for (const LatticePoint& p : apexes(d)) out.add({p.x, p.y, d.level - 1});
  return out;
}

UpToFour<Diamond> Lattice::children(const Diamond& d) const {
  UpToFour<Diamond> out;
  const int32_t s = halfSize(d.level);
  const auto add = [&](int32_t x, int32_t y) {
    if (contains({x, y})) out.add({x, y, d.level + 1});
  };
  if (d.isQuadCenter()) {
    // The middles of the square's four sides.
    add(d.x, d.y - s);
    add(d.x + s, d.y);
    add(d.x, d.y + s);
    add(d.x - s, d.y);
  } else {
    // The centres of the four half-size squares around the middle of the edge.
    const int32_t h = s / 2;
    add(d.x - h, d.y - h);
    add(d.x + h, d.y - h);
    add(d.x + h, d.y + h);
    add(d.x - h, d.y + h);
  }
  return out;
}

UpToFour<Triangle> Lattice::rootTriangles() const {
  const Diamond root{side() / 2, side() / 2, 0};
  UpToFour<Triangle> out;
  for (const LatticePoint& apex : apexes(root)) out.add({root, apex});
  return out;
}

TileId Lattice::tileOf(const Triangle& t, int tileLevel) const {
  // The middle between apex and diamond centre is inside the triangle, hence inside the tile.
  const int shift = depth_ - tileLevel + 8 + 1;
  return {tileLevel, (t.apex.x + t.diamond.x) >> shift, (t.apex.y + t.diamond.y) >> shift};
}

LatticePoint rotateQuarters(LatticePoint p, int quarters) {
  switch (quarters & 3) {
    case 0:
      return p;
    case 1:
      return {-p.y, p.x};
    case 2:
      return {-p.x, -p.y};
    default:
      return {p.y, -p.x};
  }
}

PatchPlacement placePatch(const Lattice& lattice, const PatchGrid& grid, const Triangle& t) {
  const int32_t s = lattice.halfSize(t.diamond.level);
  const int32_t dx = t.apex.x - t.diamond.x;
  const int32_t dy = t.apex.y - t.diamond.y;
  PatchPlacement out;
  if (t.diamond.isQuadCenter()) {
    // The right angle stands north-west of the hypotenuse at rotation 0, then north-east, and so on.
    out.origin = t.apex;
    out.unit = 2 * s >> grid.k;
    out.rotation = dy < 0 ? (dx < 0 ? 0 : 1) : (dx > 0 ? 2 : 3);
  } else {
    // The apex lies south of the hypotenuse at rotation 0, then west, north, east.
    out.unit = s >> grid.k;
    out.rotation = dy > 0 ? 0 : dx < 0 ? 1 : dy < 0 ? 2 : 3;
    const LatticePoint back = rotateQuarters({s, 0}, out.rotation);
    out.origin = {t.diamond.x - back.x, t.diamond.y - back.y};
  }
  TERRANE_CHECK(out.unit >= 1, "a patch of bintree level {} needs a deeper lattice than {}", t.diamond.level,
                lattice.depth());
  return out;
}

}  // namespace terrane
