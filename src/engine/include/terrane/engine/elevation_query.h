#pragma once

#include <glm/vec2.hpp>
#include <optional>

#include "terrane/dataset/dataset.h"
#include "terrane/engine/tile_pool.h"

namespace terrane {

/// Asks a dataset for heights of its full-resolution surface. Keeps decoded tiles up to a budget;
/// neighbouring questions are cheap (well below a microsecond), a tile that is not in memory costs a read and
/// a decode for each of its levels. One thread at a time.
class ElevationQuery {
 public:
  /// `dataset` must outlive the query. `maxTiles`: decoded tiles kept, about 330 kB each.
  explicit ElevationQuery(const Dataset& dataset, size_t maxTiles = 600)
      : dataset_(dataset), pool_(dataset), maxTiles_(maxTiles) {}

  /// The height in metres at a place in local coordinates, or nothing where there is no ground. Errors:
  /// tiles that cannot be read.
  Result<std::optional<double>> heightAt(glm::dvec2 local);

 private:
  const Dataset& dataset_;
  TilePool pool_;
  size_t maxTiles_;
};

}  // namespace terrane
