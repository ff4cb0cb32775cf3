#include "terrane/stream/line_estimate.h"

#include <algorithm>
#include <vector>

namespace terrane {
namespace {

/// Answers that count: enough to see through chance, few enough to notice a change.
constexpr size_t kRecent = 24;
/// As much is asked for before anything is known.
constexpr uint64_t kFirstBytes = 96U << 10;
constexpr uint64_t kLeastBytes = 16U << 10;
constexpr uint64_t kMostBytes = 16U << 20;

}  // namespace

void LineEstimate::answered(double startedSeconds, double answeredSeconds, uint64_t bytes) {
  recent_.push_back({startedSeconds, std::max(answeredSeconds, startedSeconds), bytes});
  if (recent_.size() > kRecent) recent_.pop_front();

  // Latency: what the quickest answer took beyond its bytes.
  double quickest = 1e9;
  for (const Answer& answer : recent_) {
    const double transfer =
        bytesPerSecond_ > 0.0 ? static_cast<double>(answer.bytes) / bytesPerSecond_ : 0.0;
    quickest = std::min(quickest, std::max(answer.answered - answer.started - transfer, 1e-3));
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
}

uint64_t LineEstimate::usefulBytesUnderway() const {
  if (bytesPerSecond_ <= 0.0) return kFirstBytes;
  // One and a half round trips, and a little for the time between two looks at the line.
  const double bytes = bytesPerSecond_ * (1.5 * latencySeconds_ + 0.03);
  return std::clamp(static_cast<uint64_t>(bytes), kLeastBytes, kMostBytes);
}

}  // namespace terrane
