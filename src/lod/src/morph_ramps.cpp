#include "morph_ramps.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane {

MorphRamps::MorphRamps(MorphHistory* history, int latticeDepth, int k, double elapsedSeconds)
    : history_(history), elapsedSeconds_(std::max(0.0, elapsedSeconds)) {
  next_.latticeDepth = latticeDepth;
  next_.k = k;
  if (history_ != nullptr && (history_->latticeDepth != latticeDepth || history_->k != k))
    *history_ = MorphHistory();
}

MorphRamps::Progress MorphRamps::Progress::both(const Progress& a, const Progress& b) {
  Progress out;
  out.share = std::min(a.share, b.share);
  out.moved = a.moved || b.moved;
  if (a.moved && b.moved)
    out.secondsSince = std::min(a.secondsSince, b.secondsSince);
  else
    out.secondsSince = a.moved ? a.secondsSince : b.secondsSince;
  return out;
}

void MorphRamps::holdBack(const Diamond& d) {
  if (history_ != nullptr) next_.heldBack.insert(d);
}

MorphRamps::Progress MorphRamps::advance(const Diamond& d, const Progress& parents, double wanted,
                                         double excess) {
  if (history_ == nullptr) return {};
  // Mostly nothing is on its way.
  if (!parents.moved && history_->ramps.empty() && history_->heldBack.empty()) return {};
  double share = 0.0;
  double seconds = 0.0;  // since it began, or since the last selection
  if (const auto at = history_->ramps.find(d); at != history_->ramps.end()) {
    share = at->second;
    seconds = elapsedSeconds_;
  } else if (history_->heldBack.count(d) != 0) {
    // Its tiles have come: it begins now.
  } else if (parents.moved) {
    seconds = parents.secondsSince;
  } else {
    return {};
  }

  const double speed = std::clamp(1.0 + 4.0 * std::log2(std::max(excess, 1.0)), 1.0, 16.0) / kRampSeconds;
  const double needed = std::max(0.0, wanted - share) / speed;
  if (seconds >= needed) return {1.0, seconds - needed, true};
  share += seconds * speed;
  next_.ramps.emplace(d, share);
  return {share, 0.0, true};
}

int MorphRamps::finish() {
  const auto ramping = static_cast<int>(next_.ramps.size());
  if (history_ != nullptr) *history_ = std::move(next_);
  return ramping;
}

}  // namespace terrane
