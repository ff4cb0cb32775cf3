#include "terrane/serve/metrics.h"

#include <fmt/format.h>

#include <algorithm>

namespace terrane::serve {

void Metrics::count(Route route, int status, uint64_t bytes, double seconds) {
  const auto at = std::find(kStatuses.begin(), kStatuses.end(), status);
  const auto statusIndex = static_cast<size_t>(
      (at == kStatuses.end() ? std::find(kStatuses.begin(), kStatuses.end(), 500) : at) - kStatuses.begin());
  requests_[static_cast<size_t>(route)][statusIndex].fetch_add(1, std::memory_order_relaxed);
  bytes_.fetch_add(bytes, std::memory_order_relaxed);
  const auto bucket =
      static_cast<size_t>(std::lower_bound(kBuckets.begin(), kBuckets.end(), seconds) - kBuckets.begin());
  latency_[bucket].fetch_add(1, std::memory_order_relaxed);
  latencyMicroseconds_.fetch_add(static_cast<uint64_t>(std::max(0.0, seconds) * 1e6),
                                 std::memory_order_relaxed);
}

std::string Metrics::text() const {
  std::string out =
      "# HELP terrane_requests_total Requests answered.\n# TYPE terrane_requests_total counter\n";
  for (size_t route = 0; route < requests_.size(); ++route) {
    for (size_t i = 0; i < kStatuses.size(); ++i) {
      const uint64_t count = requests_[route][i];
      if (count == 0) continue;
      out += fmt::format("terrane_requests_total{{route=\"{}\",status=\"{}\"}} {}\n",
                         routeName(static_cast<Route>(route)), kStatuses[i], count);
    }
  }
  const auto single = [&](const char* name, const char* type, const char* help, auto value) {
    out += fmt::format("# HELP {0} {1}\n# TYPE {0} {2}\n{0} {3}\n", name, help, type, value);
  };
  single("terrane_sent_bytes_total", "counter", "Bytes of answers, heads included.", bytes_.load());
  single("terrane_connections", "gauge", "Connections open now.", connections.load());
  single("terrane_connections_accepted_total", "counter", "Connections accepted.", accepted.load());
  single("terrane_connections_over_limit_total", "counter",
         "Connections turned away for there were too many.", overLimit.load());
  single("terrane_connections_timed_out_total", "counter", "Connections closed for being slow or idle.",
         timeouts.load());
  single("terrane_answers_abandoned_total", "counter", "Answers that the client did not wait for.",
         abandoned.load());

  out +=
      "# HELP terrane_request_seconds From a request's first byte to its answer's last.\n"
      "# TYPE terrane_request_seconds histogram\n";
  uint64_t below = 0;
  for (size_t i = 0; i < latency_.size(); ++i) {
    below += latency_[i];
    const std::string bound = i < kBuckets.size() ? fmt::format("{:g}", kBuckets[i]) : "+Inf";
    out += fmt::format("terrane_request_seconds_bucket{{le=\"{}\"}} {}\n", bound, below);
  }
  out += fmt::format("terrane_request_seconds_sum {:.6f}\nterrane_request_seconds_count {}\n",
                     static_cast<double>(latencyMicroseconds_) * 1e-6, below);
  return out;
}

}  // namespace terrane::serve
