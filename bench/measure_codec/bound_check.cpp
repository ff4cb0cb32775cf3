#include "bound_check.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace terrane {
namespace {

void compare(const TileSamples& samples, const std::vector<float>& expected, double bound,
             BoundCheck& check) {
  for (size_t i = 0; i < expected.size(); ++i) {
    const bool isVoid = samples.states[i] == SampleState::Void;
    if (std::isnan(expected[i]) || isVoid) {
      if (std::isnan(expected[i]) != isVoid) ++check.violations;
      continue;
    }
    const double error = std::abs(double{samples.heights[i]} - expected[i]);
    ++check.samples;
    check.largestMeters = std::max(check.largestMeters, error);
    if (error > bound) ++check.violations;
  }
}

}  // namespace

std::vector<TileId> addressesOf(const std::vector<SourceTile>& source) {
  std::vector<TileId> ids;
  for (const SourceTile& tile : source) ids.push_back(tile.id);
  return ids;
}

Result<BoundCheck> checkBound(const StoredPyramid& pyramid, const std::vector<SourceTile>& source) {
  std::unordered_map<TileId, const SourceTile*, TileIdHash> places;
  for (const SourceTile& tile : source) places[tile.id] = &tile;
  BoundCheck check;
  TERRANE_TRY(pyramid.visitFinest(addressesOf(source), [&](TileId id, const Tile& tile) {
    compare(tile.samples, places.find(id)->second->heights, pyramid.manifest().maxErrorMeters, check);
    return Status();
  }));
  return check;
}

}  // namespace terrane
