#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/tile.h"
#include "terrane/dataset/dataset.h"

namespace terrane {

/// The decoded tiles that a surface is made of: all of a dataset's, or those that are here.
class SurfaceSource {
 public:
  virtual ~SurfaceSource() = default;
  virtual const Manifest& manifest() const = 0;
  /// A stored tile; `parent` is its tile as this gave it, null for the root only. Null: it is not here, and
  /// its parent stands for it. Error: it cannot be read.
  virtual Result<std::shared_ptr<const Tile>> get(TileId id, const Tile* parent) = 0;
};

/// The decoded tiles that many threads ask the full-resolution surface of. Any thread; least recently used
/// tiles go when the budget is full. Touches no GPU.
class SurfaceTiles final : public SurfaceSource {
 public:
  /// `dataset` must outlive this. A tile takes about 350 kB.
  SurfaceTiles(const Dataset& dataset, uint64_t budgetBytes);
  ~SurfaceTiles() override;

  const Manifest& manifest() const override { return dataset_.manifest(); }
  /// Never null: what is missing is read and decoded. Two threads that miss the same tile may both decode it.
  /// Errors: it cannot be read or decoded.
  Result<std::shared_ptr<const Tile>> get(TileId id, const Tile* parent) override;

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

/// Where a straight line through the air meets the ground: a share of the line, and the height there.
struct SurfaceHit {
  double share = 0.0;
  double height = 0.0;
};

/// Walks over the finest surface that its source has, or that of a level: keeps the tiles on the way to the
/// last place, so neighbouring questions take no lock. One thread at a time; cheap to make. Where tiles come
/// and go, make one for each question: it does not look again for what was not there.
///
/// Ground is what is drawn as ground: where finer tiles are stored and not here, a coarse cell that is mostly
/// ground is all ground.
class Surface {
 public:
  /// Tiles beyond `finestLevel` are left out as if they were not here.
  explicit Surface(SurfaceSource& source, int finestLevel = kMaxLevel)
      : source_(source), finestLevel_(finestLevel) {}

  /// The height in metres at sample coordinates (tiling/frame.h), or nothing where there is no ground. Ground
  /// has its border: a place between cells has the height of any of them.
  Result<std::optional<double>> heightAt(glm::dvec2 sample);

  /// The same, and where there is no ground what the void was filled with: a smooth continuation of what is
  /// around. Nothing beyond the world.
  Result<std::optional<double>> filledHeightAt(glm::dvec2 sample);

  /// How far heightAt() may be off the full-resolution source, metres: a bound. Nothing where there is no
  /// ground.
  Result<std::optional<double>> errorAt(glm::dvec2 sample);

  /// The pieces of the straight line between two places in sample coordinates, in order and without gaps:
  /// every crossing with an edge of the surface's triangles ends one, so the line over the surface is given
  /// exactly. Coarse triangles where no finer detail is stored are taken whole. Outside the world is void.
  /// Errors: more than `maxPieces`; tiles that cannot be read.
  Result<std::vector<SurfacePiece>> along(glm::dvec2 from, glm::dvec2 to, size_t maxPieces);

  /// Where the straight line from `from` to `to` (sample coordinates and a height in metres) first goes
  /// through the surface, from above or from below; nothing where it does not. Exact: no triangle is stepped
  /// over. Where tiles of two levels meet with a step, the line cannot slip through it. Cost: about 0.1
  /// microseconds for each 16 x 16 cells on the way, more where the ground is near the line. Error: tiles
  /// that cannot be read.
  Result<std::optional<SurfaceHit>> firstHit(glm::dvec3 from, glm::dvec3 to);

 private:
  struct Level {
    TileId id;
    std::shared_ptr<const Tile> tile;
    uint8_t absent = 0;  ///< children that are stored and not here, one bit each
  };
  /// Goes to the deepest tile that is here at a cell of the finest level.
  Status goTo(int64_t col, int64_t row);
  /// The same at a place; false outside of the world.
  Result<bool> goTo(glm::dvec2 sample);
  /// The place in cells of the tile that goTo() went to.
  glm::dvec2 placeInTile(glm::dvec2 sample) const;
  /// heightAt() of the cells to the west and north, as far as the place lies on their border.
  Result<std::optional<double>> heightAtBorder(glm::dvec2 sample);

  SurfaceSource& source_;
  int finestLevel_;
  std::vector<Level> path_;    ///< from the root down
  bool isUnfinished_ = false;  ///< where goTo() went, finer tiles are stored
};

}  // namespace terrane
