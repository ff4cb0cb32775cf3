#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "terrane/engine/terrain_view.h"

namespace terrane {

/// Terrender's way to stream (paper 000, 4.3.3), for comparison: a set of tiles is asked for at once and
/// drawn from when all of it is here; only then is the next set chosen, for the camera of that time.
class GatheredSets {
 public:
  using Needed = std::function<std::vector<TileId>(const Camera&, const PatchSelection&)>;
  GatheredSets(StreamPolicy policy, Needed needed) : policy_(policy), needed_(std::move(needed)) {}

  /// Chooses the next set unless one is under way. `isHopeless`: the tile will not come.
  void begin(const Camera& camera, const PatchSelection& selection, const ResidentTiles& resident,
             const std::function<bool(TileId)>& isHopeless);
  const std::vector<TileId>& tiles() const { return set_; }
  bool isEmpty() const { return set_.empty(); }
  /// Is a set under way, and all of it here?
  bool isComplete(const std::function<bool(TileId)>& isHere) const;
  std::vector<TileId> take() { return std::exchange(set_, {}); }

 private:
  StreamPolicy policy_;
  Needed needed_;
  std::vector<TileId> set_;
};

}  // namespace terrane
