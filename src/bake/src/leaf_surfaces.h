#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "terrane/tiling/lattice.h"
#include "terrane/tiling/tile_id.h"

namespace terrane {

/// A tile as the bintree sees it: its square is two triangles, halved eight times into 512 atoms, each half
/// of a 16 x 16 square. Siblings stand side by side, so that the triangle `depth` halvings down that holds an
/// atom is atom >> (8 - depth), two triangles at depth 0.
struct TileBisection {
  static constexpr int kDepth = 8;
  static constexpr int kAtoms = 512;
  static constexpr int kSquares = 16;  ///< along a side
  static constexpr int kSquareCells = kTileCells / kSquares;

  struct Atom {
    int square = 0;     ///< row * kSquares + col
    bool east = false;  ///< the half with the square's eastern side
  };
  std::array<Atom, kAtoms> atoms;
  /// Tile-local centres of the triangles' diamonds, and their apexes, by depth.
  std::array<std::vector<LatticePoint>, kDepth + 1> centers;
  std::array<std::vector<LatticePoint>, kDepth + 1> apexes;

  /// The bisection of tiles whose col + row is even, or odd.
  static const TileBisection& of(TileId id);
};

/// A value for each atom.
using AtomValues = std::array<float, TileBisection::kAtoms>;

/// Takes rows of a tile and keeps the largest value in every atom, borders included.
class AtomMaximum {
 public:
  /// `floor`: what an atom without a value has.
  explicit AtomMaximum(float floor) : floor_(floor) {}
  void begin();
  /// Row y of 257 values, from 0 to 256 in order; NaN does not count.
  void addRow(int y, const float* values);
  /// After the last row.
  void finish(const TileBisection& bisection, AtomValues& out) const;

 private:
  void addToBand(int band, int row, const float* values);

  float floor_;
  // For each square its 16 western columns, four times four lanes; the eastern one stands apart.
  std::array<float, 256 * 16> west_;
  std::array<float, 256 * 16> east_;
  std::array<float, 256> westLast_;
  std::array<float, 256> eastLast_;
};

/// Compares a tile's samples with coarser surfaces.
class LeafSurfaces {
 public:
  LeafSurfaces();

  /// `heights`: the tile's; `ground`: the same, NaN where void.
  void setTile(TileId id, const std::vector<float>& heights, const std::vector<float>& ground);

  /// Lowest and highest ground in each atom; +inf and -inf where there is none.
  void range(AtomValues& low, AtomValues& high);

  /// Largest |ground - surface| in each atom. The surface is made from a lattice whose cells have 2^cellShift
  /// of the tile's, at most 8; where `quincunx`, only of its samples with an even sum of coordinates.
  /// `corners`: the surface at the tile's own corners (north-west, north-east, south-west, south-east), asked
  /// for where the tile does not hold enough of the lattice itself.
  void compare(int cellShift, bool quincunx, const std::array<float, 4>& corners, AtomValues& out);
  /// The same surface at the corners of the tile's 16 x 16 squares, 17 x 17 values row by row, for lattices
  /// whose cells are at least as large as these squares: then it is linear over each atom.
  using SquareCorners = std::array<float, 17 * 17>;
  void atSquareCorners(int cellShift, bool quincunx, const std::array<float, 4>& corners, SquareCorners& out);
  static constexpr int kLinearShift = 4;

  /// Largest |ground - surface| in one atom, for a surface that is linear over it.
  float compareAtom(const TileBisection::Atom& atom, const SquareCorners& surface) const;

  /// Does compare() need the corners?
  static bool needsCorners(int cellShift) { return cellShift >= 8; }

 private:
  static constexpr int kStride = 264;

  /// The lattice's samples in this tile, into coarse_; gives the cells along its side.
  int takeLattice(int cellShift, bool quincunx, const std::array<float, 4>& corners);
  /// Doubles coarse_ until the tile has `wanted` cells along its side.
  void doubleTo(int wanted, int& cells);
  int parityOf(int cells) const { return cells == 1 ? (id_.col + id_.row) & 1 : 0; }

  TileId id_;
  const float* heights_ = nullptr;
  const float* ground_ = nullptr;
  std::vector<float> coarse_;
  std::vector<float> fine_;
  std::vector<float> differences_;
  AtomMaximum maximum_;
};

/// Doubles a lattice row: `even` gets the northern row with the means between its samples, `odd` the row
/// between north and south. `parity`: whether the first cell's hypotenuse falls to the south-west (1) or
/// south-east (0). The rows hold cells + 1 samples and may be read and written up to 8 beyond.
void doubleRow(const float* north, const float* south, int cells, int parity, float* even, float* odd);

}  // namespace terrane
