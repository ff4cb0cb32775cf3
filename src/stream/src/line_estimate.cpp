#include "terrane/stream/line_estimate.h"

#include <algorithm>
#include <vector>

namespace terrane {
namespace {

/// Answers that count: enough to see through chance, few enough to notice a change.
constexpr size_t kRecent = 24;
constexpr double kLeastBytes = 8 << 10;
constexpr double kMostBytes = 16 << 20;
/// Answers may wait behind others for so long, and half the latency: the price of a line that never runs dry.
constexpr double kQueueSeconds = 0.06;
constexpr double kShrink = 0.8;

}  // namespace

void LineEstimate::answered(double startedSeconds, double answeredSeconds, uint64_t bytes) {
  recent_.push_back({startedSeconds, std::max(answeredSeconds, startedSeconds), bytes});
  if (recent_.size() > kRecent) recent_.pop_front();

  // Latency: what the quickest answer took beyond its bytes.
  double quickest = 1e9;
  for (const Answer& answer : recent_) {
    const double transfer =
        bytesPerSecond_ > 0.0 ? static_cast<double>(answer.bytes) / bytesPerSecond_ : 0.0;
    // note: while the speed is underestimated, the bytes explain too much of the time.
    const double took = answer.answered - answer.started;
    quickest = std::min(quickest, std::max({took - transfer, 0.5 * took, 1e-3}));
  }
  latencySeconds_ = quickest;

  // Speed: the bytes over the time in which some request waited for more than its latency.
  std::vector<Answer> byStart(recent_.begin(), recent_.end());
  std::sort(byStart.begin(), byStart.end(),
            [](const Answer& a, const Answer& b) { return a.answered < b.answered; });
  double busy = 0.0, last = 0.0, sum = 0.0;
  for (const Answer& answer : byStart) {
    const double begin = std::max(answer.started + 0.7 * latencySeconds_, last);
    busy += std::max(answer.answered - begin, 0.0);
    last = std::max(last, answer.answered);
    sum += static_cast<double>(answer.bytes);
  }
  if (busy > 1e-6) bytesPerSecond_ = sum / busy;

  // Did this one wait behind others?
  const double transfer =
      bytesPerSecond_ > 0.0 ? static_cast<double>(bytes) / bytesPerSecond_ : 0.0;
  const double queued = answeredSeconds - startedSeconds - latencySeconds_ - transfer;
  if (queued <= kQueueSeconds + 0.5 * latencySeconds_) {
    window_ = std::min(window_ + static_cast<double>(bytes), kMostBytes);
  } else if (answeredSeconds > lastShrunk_ + latencySeconds_) {
    window_ = std::max(window_ * kShrink, kLeastBytes);
    lastShrunk_ = answeredSeconds;
  }
}

}  // namespace terrane
