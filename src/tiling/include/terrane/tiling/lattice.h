#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>

#include "terrane/tiling/tile_id.h"

/// The diamond lattice: longest-edge bisection of the square world, said once, as arithmetic on integers.
/// docs/architecture.md tells it in prose and pictures; nothing else in Terrane re-derives it.
///
/// The world is one square, cut along its north-west to south-east diagonal into two right triangles of
/// *bintree level* 0. Splitting a triangle at the middle of its hypotenuse gives two triangles one level
/// deeper. The middle is a *diamond*: it stands for the (at most two) triangles that share the hypotenuse,
/// and these are only ever split together. Every sample of the grid but the world's corners is one diamond.
///
///     even level: quad-centre          odd level: edge-centre
///
///       a-------h  2s                    .---a---.       v  the diamond, half-size s
///       |     / |                        | / | \ |       h  ends of its hypotenuse
///       |   v   |                        h---v---h       a  apexes: its parents' centres
///       | /     |                        | \ | / |
///       h-------a                        .---a---.
///
/// Coordinates: x east, y south, in cells of a chosen *depth* (tile level whose samples are the unit), so
/// that the world's side is 256 * 2^depth.
namespace terrane {

/// A point of the lattice.
struct LatticePoint {
  int32_t x = 0;
  int32_t y = 0;
  friend bool operator==(const LatticePoint&, const LatticePoint&) = default;
  friend auto operator<=>(const LatticePoint&, const LatticePoint&) = default;
};

/// A diamond: its centre and its bintree level (even: quad-centre, odd: edge-centre). The level follows from
/// the centre and the lattice's depth, it is carried along because everybody needs it.
struct Diamond {
  int32_t x = 0;
  int32_t y = 0;
  int32_t level = 0;
  friend bool operator==(const Diamond&, const Diamond&) = default;
  friend auto operator<=>(const Diamond&, const Diamond&) = default;
  bool isQuadCenter() const { return level % 2 == 0; }
  LatticePoint center() const { return {x, y}; }
};

struct DiamondHash {
  size_t operator()(const Diamond& d) const {
    const uint64_t key = static_cast<uint64_t>(static_cast<uint32_t>(d.x)) << 32 | static_cast<uint32_t>(d.y);
    return static_cast<size_t>((key ^ key >> 31) * 0x9e3779b97f4a7c15ULL >> 5);
  }
};

/// One triangle of the bintree: half of its diamond, named by the corner opposite to the hypotenuse. It has
/// its diamond's level.
struct Triangle {
  Diamond diamond;
  LatticePoint apex;
  friend bool operator==(const Triangle&, const Triangle&) = default;
};

/// At most four diamonds or points, those outside the world left out.
template <class T>
struct UpToFour {
  std::array<T, 4> items{};
  int count = 0;
  void add(const T& item) { items[static_cast<size_t>(count++)] = item; }
  const T* begin() const { return items.data(); }
  const T* end() const { return items.data() + count; }
};

/// The lattice whose unit is the sample spacing of tile level `depth`.
class Lattice {
 public:
  explicit Lattice(int depth) : depth_(depth) {}

  int depth() const { return depth_; }
  /// Cells along the world's side.
  int32_t side() const { return static_cast<int32_t>(kTileCells) << depth_; }
  bool contains(LatticePoint p) const { return p.x >= 0 && p.y >= 0 && p.x <= side() && p.y <= side(); }
  /// The deepest bintree level that has diamonds with integer coordinates.
  int deepestLevel() const { return 2 * (7 + depth_) + 1; }

  /// Half-size s of the diamonds of a bintree level: a quad-centre's square has the side 2s, an edge-centre's
  /// hypotenuse the length 2s.
  int32_t halfSize(int level) const { return side() >> (level / 2 + 1); }

  /// The diamond at a point; the point must be in the world and not one of its four corners.
  Diamond diamondAt(LatticePoint center) const;

  /// The two ends of the diamond's hypotenuse; always in the world.
  std::array<LatticePoint, 2> hypotenuse(const Diamond& d) const;
  /// The apexes in the world: two, or one for an edge-centre on the world's border. They are the centres of
  /// the diamond's parents (the world's corners, at level 0, are nobody's centre).
  UpToFour<LatticePoint> apexes(const Diamond& d) const;
  /// The diamonds one level up that must be split before this one exists; none at level 0.
  UpToFour<Diamond> parents(const Diamond& d) const;
  /// The diamonds one level down, in the world, that have this one as a parent.
  UpToFour<Diamond> children(const Diamond& d) const;

  /// The triangles that splitting the diamond makes: four, or two on the world's border. They are one level
  /// deeper and have the diamond's centre as their apex.
  UpToFour<Triangle> trianglesAfterSplit(const Diamond& d) const { return trianglesAround(children(d), d); }
  /// The triangles that exist before anything is split.
  static constexpr int kRootTriangles = 2;
  UpToFour<Triangle> rootTriangles() const;

  /// The tile of `tileLevel` (at most depth) that holds the triangle; the triangle must fit into one.
  TileId tileOf(const Triangle& t, int tileLevel) const;

 private:
  static UpToFour<Triangle> trianglesAround(const UpToFour<Diamond>& children, const Diamond& parent) {
    UpToFour<Triangle> out;
    for (const Diamond& child : children) out.add({child, parent.center()});
    return out;
  }

  int depth_;
};

/// How K-patches lie in tiles (paper 000, appendix A): a patch is a bintree triangle drawn with
/// K = 2^k + 1 vertices along each of its sides, with heights from the coarsest tile that has a sample for
/// every vertex.
struct PatchGrid {
  int k = 4;  ///< 1 to 7, K = 3 to 129

  static constexpr int kSmallest = 1;
  static constexpr int kLargest = 7;

  int cellsPerSide() const { return 1 << k; }
  int samplesPerSide() const { return cellsPerSide() + 1; }
  int trianglesPerPatch() const { return cellsPerSide() * cellsPerSide(); }
  /// The bintree level whose right-angle patches have the root tile's sample spacing.
  int rootLevels() const { return 2 * (8 - k); }
  /// The level of the tile that a patch of this bintree level reads.
  int tileLevel(int bintreeLevel) const {
    return bintreeLevel <= rootLevels() ? 0 : (bintreeLevel - rootLevels() + 1) / 2;
  }
  /// The deepest bintree level whose patches find their samples in tiles of `tileLevel`.
  int deepestLevel(int tileLevel) const { return rootLevels() + 2 * tileLevel; }
};

/// Where a patch's template lies on the lattice: template vertex (i, j) is at
/// `origin + unit * rotate(rotation, (i, j))`. Even levels use the right-angle template (apex at (0, 0), legs
/// along i and j, 0 <= i, j and i + j <= K - 1), odd levels the hypotenuse template (hypotenuse from (0, 0)
/// to (2(K - 1), 0), apex at (K - 1, K - 1), vertices where i + j is even).
struct PatchPlacement {
  LatticePoint origin;
  int32_t unit = 1;
  int32_t rotation = 0;  ///< quarter turns, 0 to 3, from x towards y (clockwise on the map)
};

/// Rotates by quarter turns from x towards y.
LatticePoint rotateQuarters(LatticePoint p, int quarters);

/// Places the template of a patch. The lattice must be deep enough that the template's unit is an integer:
/// `grid.tileLevel(level) <= lattice.depth()`.
PatchPlacement placePatch(const Lattice& lattice, const PatchGrid& grid, const Triangle& triangle);

}  // namespace terrane
