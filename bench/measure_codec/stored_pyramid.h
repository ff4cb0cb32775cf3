#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "terrane/dataset/dataset.h"

namespace terrane {

/// All payloads of a dataset's elevation in memory, ready to be decoded.
class StoredPyramid {
 public:
  static Result<StoredPyramid> open(const std::string& directory);

  const Manifest& manifest() const { return manifest_; }
  uint64_t bytes() const;
  uint64_t finestBytes() const;
  int64_t finestTiles() const;

  /// What is done with a decoded tile; an error ends the visit.
  using UseTile = std::function<Status(TileId, const Tile&)>;
  /// Decodes every stored tile once, parents before children, in the calling thread. The memory of tiles
  /// whose children are done is used again.
  Status decodeAll(const UseTile& use) const;
  Status decodeAll() const;
  /// Gives each of these tiles of the finest level, from the north-west quadrants on: decoded where it is
  /// stored, interpolated where not. In the calling thread.
  Status visitFinest(std::span<const TileId> finest, const UseTile& use) const;

 private:
  struct StoredTile {
    TileId id;
    TilePayloads payloads;
    std::array<int, 4> children = {-1, -1, -1, -1};  ///< indices, -1: not stored
  };
  explicit StoredPyramid(Manifest manifest) : manifest_(std::move(manifest)) {}
  Status decodeBelow(const StoredTile& stored, const TileSamples* parent, const UseTile& use,
                     std::vector<Tile>& unused) const;
  class FinestVisit;

  Manifest manifest_;
  std::vector<StoredTile> tiles_;  ///< the root first
};

}  // namespace terrane
