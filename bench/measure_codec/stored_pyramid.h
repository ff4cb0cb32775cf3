#pragma once

#include <array>
#include <string>
#include <vector>

#include "source_tiles.h"
#include "terrane/dataset/dataset.h"

namespace terrane {

/// How a dataset's finest samples keep to what they were made from.
struct BoundCheck {
  int64_t samples = 0;     ///< compared
  int64_t violations = 0;  ///< further off than the bound, or void on one side only
  double largestMeters = 0.0;
};

/// All payloads of a dataset's elevation in memory, ready to be decoded.
class StoredPyramid {
 public:
  static Result<StoredPyramid> open(const std::string& directory);

  const Manifest& manifest() const { return manifest_; }
  uint64_t bytes() const;
  uint64_t finestBytes() const;
  int64_t finestTiles() const;

  /// Decodes every stored tile once, parents before children, in the calling thread. The memory of tiles
  /// whose children are done is used again.
  Status decodeAll() const;
  /// Compares every sample of the source, also where the dataset stores no tile. The bound is the manifest's
  /// and holds for the floats as they are: a build keeps room for their rounding.
  Result<BoundCheck> check(const std::vector<SourceTile>& source) const;

 private:
  struct StoredTile {
    TileId id;
    std::vector<uint8_t> payload;
    std::array<int, 4> children = {-1, -1, -1, -1};  ///< indices, -1: not stored
  };
  explicit StoredPyramid(Manifest manifest) : manifest_(std::move(manifest)) {}
  Status decodeBelow(const StoredTile& stored, const TileSamples* parent, std::vector<Tile>& unused) const;
  class Checker;

  Manifest manifest_;
  std::vector<StoredTile> tiles_;  ///< the root first
};

}  // namespace terrane
