#pragma once

#include <cstdint>
#include <deque>

namespace terrane {

/// How fast the line is, from what it has done. A plain value.
class LineEstimate {
 public:
  /// A request was answered whole: when it was started and answered (seconds of one clock), its bytes.
  void answered(double startedSeconds, double answeredSeconds, uint64_t bytes);

  /// Bytes a second, 0 while nothing is known.
  double bytesPerSecond() const { return bytesPerSecond_; }
  /// From a request to its first byte; a guess before anything is known.
  double latencySeconds() const { return latencySeconds_; }
  /// Bytes that should be under way so that the line never runs dry, and little more: they grow while answers
  /// come as fast as they can, and shrink when answers queue up.
  uint64_t usefulBytesUnderway() const { return static_cast<uint64_t>(window_); }

 private:
  struct Answer {
    double started, answered;
    uint64_t bytes;
  };
  std::deque<Answer> recent_;
  double bytesPerSecond_ = 0.0;
  double latencySeconds_ = 0.1;
  double window_ = kFirstBytes;
  double lastShrunk_ = -1e9;

  /// As much is asked for before anything is known.
  static constexpr double kFirstBytes = 64 << 10;
};

}  // namespace terrane
