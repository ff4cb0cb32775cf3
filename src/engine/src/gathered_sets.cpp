#include "gathered_sets.h"

#include <algorithm>

namespace terrane {
namespace {

/// "If the ratio [between the not loaded and loaded quadtree nodes] exceeds a certain threshold, the bintree
/// creation is stopped at the current level." The paper does not say which; this one served it best
/// (docs/performance.md).
constexpr double kMostMissingShare = 1.0;

}  // namespace

void GatheredSets::begin(const Camera& camera, const PatchSelection& selection,
                         const ResidentTiles& resident, const std::function<bool(TileId)>& isHopeless) {
  if (!set_.empty() || !needed_) return;
  std::vector<TileId> needed = needed_(camera, selection);
  // note: by address, so level by level.
  std::sort(needed.begin(), needed.end());
  size_t loaded = 0;
  for (size_t i = 0; i < needed.size();) {
    size_t end = i;
    while (end < needed.size() && needed[end].level == needed[i].level) ++end;
    for (; i < end; ++i) {
      if (resident.find(needed[i]) != nullptr)
        ++loaded;
      else if (!isHopeless(needed[i]))
        set_.push_back(needed[i]);
    }
    // At least one level that is not here yet.
    if (policy_ == StreamPolicy::Progressive && !set_.empty() &&
        static_cast<double>(set_.size()) > kMostMissingShare * static_cast<double>(loaded))
      return;
  }
}

bool GatheredSets::isComplete(const std::function<bool(TileId)>& isHere) const {
  return !set_.empty() && std::all_of(set_.begin(), set_.end(), isHere);
}

}  // namespace terrane
