#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "terrane/serve/http_message.h"

namespace terrane::serve {

/// What the server counts, as Prometheus reads it. Any thread; counting takes no lock.
class Metrics {
 public:
  /// A request was answered: what it was, how it went, what was sent, and how long that took from the first
  /// byte of its head to the last byte of the answer given to the system.
  void count(Route route, int status, uint64_t bytes, double seconds);

  std::atomic<int64_t> connections{0};  ///< open now
  std::atomic<uint64_t> accepted{0};    ///< since the start
  std::atomic<uint64_t> overLimit{0};   ///< turned away with 503, or closed, for there were too many
  std::atomic<uint64_t> timeouts{0};    ///< closed for being slow or idle
  std::atomic<uint64_t> abandoned{0};   ///< closed by the client while it was being answered

  /// The text format, version 0.0.4, without what others add.
  std::string text() const;

 private:
  static constexpr std::array<int, 19> kStatuses = {200, 204, 206, 304, 400, 404, 405, 408, 411, 412,
                                                    413, 414, 415, 416, 417, 431, 500, 503, 505};
  static constexpr std::array<double, 10> kBuckets = {0.0001, 0.0003, 0.001, 0.003, 0.01,
                                                      0.03,   0.1,    0.3,   1.0,   10.0};
  std::array<std::array<std::atomic<uint64_t>, kStatuses.size()>, kRouteCount> requests_{};
  std::atomic<uint64_t> bytes_{0};
  std::array<std::atomic<uint64_t>, kBuckets.size() + 1> latency_{};
  std::atomic<uint64_t> latencyMicroseconds_{0};
};

}  // namespace terrane::serve
