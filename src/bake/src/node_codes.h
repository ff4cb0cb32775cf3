#pragma once

#include <array>
#include <optional>

#include "node_stores.h"
#include "pyramid.h"

/// The parts of saturateNodes() (node_measure.h), for one tile each.
namespace terrane {

/// Puts together what was measured over a tile and what its stored children have gathered. `measured` is null
/// where the tile itself was not measured.
Status gatherNodes(const Pyramid& pyramid, const NodeStores& stores, const PyramidTile& tile,
                   const MeasuredNodes* measured, GatheredNodes& out);

/// The final codes of the tiles of the next level that hold anything of one tile.
class CodesBelow {
 public:
  /// Reads those of the tile's stored children, and, where a child is not stored, of the tiles around them.
  Status read(const Pyramid& pyramid, const NodeStores& stores, const PyramidTile& tile);

  /// The codes that hold a point of the next level's lattice, which lies in the tile; null: nobody stored
  /// does. `local`: the point in the cells of the tile that holds it.
  const TileCodes* holding(LatticePoint point, LatticePoint& local) const;

 private:
  static constexpr int kSide = 4;  ///< the children and one tile around them
  int firstCol_ = 0;
  int firstRow_ = 0;
  std::array<TileCodes, kSide * kSide> codes_;
  std::array<bool, kSide * kSide> there_{};
};

/// What coding one tile starts from.
struct CodingTask {
  TileId id;
  const ElevationScale& scale;
  double maxErrorMeters;
  const MeasuredNodes* measured;  ///< null: not measured
  const GatheredNodes& gathered;
  const CodesBelow& below;
};

/// Codes for K = 17, and those of larger patches, each as the tile alone and the level below demand.
Status codeNodes(const CodingTask& task, TileCodes& codes);
Status codeLargeNodes(const CodingTask& task, TileCodes& codes);

/// Raises the codes of nodes on a border to those of the neighbour across; `side` 0 to 3: north, east, south,
/// west.
void joinNodes(bool isRoot, int side, const TileCodes& neighbour, TileCodes& codes);
void joinLargeNodes(bool isRoot, int side, const TileCodes& neighbour, TileCodes& codes);

/// Points along a tile's border, and the same points in the neighbour across.
struct BorderPair {
  LatticePoint here;
  LatticePoint there;
};
inline BorderPair borderPair(int side, int at) {
  switch (side) {
    case 0:
      return {{at, 0}, {at, kTileCells}};
    case 1:
      return {{kTileCells, at}, {0, at}};
    case 2:
      return {{at, kTileCells}, {at, 0}};
    default:
      return {{0, at}, {kTileCells, at}};
  }
}

}  // namespace terrane
