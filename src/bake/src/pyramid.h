#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "block_store.h"
#include "terrane/base/result.h"
#include "terrane/codec/tile.h"
#include "terrane/tiling/lattice.h"

namespace terrane {

/// A tile while a dataset is made or checked. What is large of it lies in the Pyramid's stores.
struct PyramidTile {
  TileId id;
  std::array<int32_t, 4> children{-1, -1, -1, -1};  ///< indices on the next level, -1: not here
  int64_t block = -1;                               ///< its number in all stores
  bool filled = false;                              ///< its final heights are not its raw ones
  bool hasStates = false;                           ///< false: all samples are Coded
  bool hasLayers = false;                           ///< false: all that are Coded are of the first layer
  bool complete = false;                            ///< no sample is Void
  bool hasNeeds = false;                            ///< of the finest level, while that is read
  bool rough = false;                               ///< surely not what interpolation makes of its parent
  Coverage::Kind coverage = Coverage::Kind::None;
  bool significant = true;   ///< not what interpolation makes of its parent
  bool stored = true;        ///< false: it and all below it are what interpolation makes of its parent
  bool measured = false;     ///< its own samples were measured (measureNodes())
  ChildSummary nodes;        ///< all of its nodes' codes together, for its parent
  uint8_t typicalError = 0;  ///< median code of its smallest nodes, those over ground
};

/// The error and height range of every node of a level's tiles, in memory: tile i has the nodes from
/// i * nodesPerTile. For checks; a build keeps them in stores (NodeStores).
struct LevelNodes {
  int nodesPerTile = 0;
  std::vector<float> error;  ///< largest |patch - finest ground sample|; 0 where nothing was measured
  std::vector<float> low;    ///< over ground; low > high: no ground
  std::vector<float> high;
  std::vector<uint8_t> errorCode;
  std::vector<uint8_t> largeErrorCode;  ///< of larger patches: tile i has tileLargeNodeCount() of them
  std::vector<uint16_t> lowCode;
  std::vector<uint16_t> highCode;
};

/// All tiles that hold data, from the root to the finest level: which there are, and their samples. Reading
/// and writing different tiles' samples may happen side by side. In memory there are some hundred bytes a
/// tile.
class Pyramid {
 public:
  /// `layerCount`: the dataset's layers of significance.
  Pyramid(int finestLevel, const Scratch& scratch, int layerCount = 1);

  int finestLevel() const { return static_cast<int>(levels.size()) - 1; }
  int layerCount() const { return layerCount_; }
  /// The index of a tile on its level, or -1.
  int find(TileId id) const;
  /// Fills in children; call it when all levels stand.
  void link();
  /// A stored tile that holds a point of its level's lattice, and the point in its cells. A point on a border
  /// is in two tiles, of which either is given.
  struct PlacedPoint {
    int tile = -1;  ///< index on the level, -1: no stored tile holds it
    LatticePoint local;
  };
  PlacedPoint findStored(int level, LatticePoint point) const;
  /// Is there a stored tile?
  bool isStored(TileId id) const;

  /// Raw heights: as the inputs have them, NaN where they have none.
  Status readRawHeights(const PyramidTile& tile, std::span<float> heights) const;
  Status writeRawHeights(const PyramidTile& tile, std::span<const float> heights);
  /// Final heights: the raw ones where nothing was `filled`. note: they never overwrite raw ones, so that a
  /// step that was killed can be done again.
  Status readHeights(const PyramidTile& tile, std::span<float> heights) const;
  Status writeFilledHeights(const PyramidTile& tile, std::span<const float> heights);
  /// One sample of a tile.
  Result<float> readHeight(const PyramidTile& tile, int x, int y) const;
  Status readStates(const PyramidTile& tile, std::span<SampleState> states) const;
  Status writeStates(const PyramidTile& tile, std::span<const SampleState> states);
  /// The layer of significance of each Coded sample.
  Status readLayers(const PyramidTile& tile, std::span<uint8_t> layers) const;
  Status writeLayers(const PyramidTile& tile, std::span<const uint8_t> layers);
  Status readCoverage(const PyramidTile& tile, Coverage& coverage) const;
  Status writeCoverageBits(const PyramidTile& tile, std::span<const uint8_t> bits);
  /// All of a tile's samples; sizes the arrays.
  Status readSamples(const PyramidTile& tile, TileSamples& samples) const;

  /// Tiles by level, in the order of TileId.
  std::vector<std::vector<PyramidTile>> levels;
  std::vector<LevelNodes> nodes;  ///< for checks only

 private:
  int layerCount_;
  BlockStore raw_;
  BlockStore filled_;
  BlockStore states_;
  BlockStore layers_;
  BlockStore coverage_;
};

}  // namespace terrane
