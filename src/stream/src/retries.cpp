#include "retries.h"

#include <algorithm>
#include <limits>

#include "back_off.h"

namespace terrane {
namespace {

/// What is given up is tried again after so long.
constexpr double kLostSeconds = 60.0;

}  // namespace

void Retries::unreachable(uint64_t requestId, double nowSeconds) {
  ++offlineTries_;
  offlineUntil_ = nowSeconds + std::min(5.0, backOff(offlineTries_, requestId));
}

bool Retries::openingFailed(int file, double nowSeconds) {
  Tries& tries = opening_[file];
  if (++tries.failures >= kMostBusy) return false;
  tries.notBefore = nowSeconds + backOff(tries.failures, static_cast<uint64_t>(std::max(file, 0)) + 7);
  return true;
}

bool Retries::isOpeningDue(int file, double nowSeconds) const {
  const auto at = opening_.find(file);
  return at == opening_.end() || nowSeconds >= at->second.notBefore;
}

void Retries::directoryFailed(int file, uint64_t offset, FetchProblem problem, double nowSeconds) {
  Tries& tries = directories_[{file, offset}];
  ++tries.failures;
  tries.isLost = problem == FetchProblem::Missing || tries.failures >= kMostBusy;
  tries.notBefore = nowSeconds + (tries.isLost ? kLostSeconds : backOff(tries.failures, offset));
}

bool Retries::isDirectoryDue(int file, uint64_t offset, double nowSeconds) const {
  const auto at = directories_.find({file, offset});
  return at == directories_.end() || nowSeconds >= at->second.notBefore;
}

bool Retries::isDirectoryLost(int file, uint64_t offset) const {
  const auto at = directories_.find({file, offset});
  return at != directories_.end() && at->second.isLost;
}

void tileFailed(const TileKey& key, ShelfEntry& entry, FetchProblem problem, double atLeastSeconds,
                double nowSeconds) {
  ++entry.failures;
  if (problem != FetchProblem::Busy) ++entry.damages;
  if (problem == FetchProblem::Missing) {
    entry.lost = true;
    entry.notBefore = std::numeric_limits<double>::infinity();
  } else if (entry.failures >= kMostBusy || entry.damages >= kMostDamaged) {
    entry.lost = true;
    entry.notBefore = nowSeconds + kLostSeconds;
  } else {
    entry.notBefore = nowSeconds + std::max(atLeastSeconds, backOff(entry.failures, TileKeyHash{}(key)));
  }
}

}  // namespace terrane
