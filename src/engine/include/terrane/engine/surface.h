#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/tile.h"
#include "terrane/dataset/dataset.h"

namespace terrane {

/// The decoded tiles that many threads ask the full-resolution surface of. Any thread; least recently used
/// tiles go when the budget is full. Touches no GPU.
class SurfaceTiles {
 public:
  /// `dataset` must outlive this. A tile takes about 350 kB.
  SurfaceTiles(const Dataset& dataset, uint64_t budgetBytes);
  ~SurfaceTiles();

  /// A stored tile, decoded if need be; `parent` is its decoded parent, null for the root only. Two threads
  /// that miss the same tile may both decode it. Errors: it cannot be read or decoded.
  Result<std::shared_ptr<const Tile>> get(TileId id, const Tile* parent);

  const Dataset& dataset() const { return dataset_; }
  struct Statistics {
    uint64_t hits = 0;
    uint64_t misses = 0;
    uint64_t bytes = 0;  ///< decoded, in memory
  };
  Statistics statistics() const;

 private:
  struct State;
  const Dataset& dataset_;
  std::unique_ptr<State> state_;
};

/// What a straight line over the ground meets in one triangle of the surface: heights change linearly between
/// the two ends. `begin` and `end` are shares of the line, 0 to 1.
struct SurfacePiece {
  double begin = 0.0;
  double end = 0.0;
  bool isGround = false;  ///< false: void, the heights mean nothing
  double beginHeight = 0.0;
  double endHeight = 0.0;
};

/// Walks over the full-resolution surface: keeps the tiles on the way to the last place, so neighbouring
/// questions take no lock. One thread at a time; cheap to make.
class Surface {
 public:
  explicit Surface(SurfaceTiles& tiles) : tiles_(tiles) {}

  /// The height in metres at sample coordinates (tiling/frame.h), or nothing where there is no ground.
  Result<std::optional<double>> heightAt(glm::dvec2 sample);

  /// The pieces of the straight line between two places in sample coordinates, in order and without gaps:
  /// every crossing with an edge of the surface's triangles ends one, so the line over the surface is given
  /// exactly. Coarse triangles where no finer detail is stored are taken whole. Outside the world is void.
  /// Errors: more than `maxPieces`; tiles that cannot be read.
  Result<std::vector<SurfacePiece>> along(glm::dvec2 from, glm::dvec2 to, size_t maxPieces);

 private:
  struct Level {
    TileId id;
    std::shared_ptr<const Tile> tile;
  };
  /// Goes to the deepest stored tile at a cell of the finest level.
  Status goTo(int64_t col, int64_t row);

  SurfaceTiles& tiles_;
  std::vector<Level> path_;  ///< from the root down
};

}  // namespace terrane
