#pragma once

#include <deque>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "terrane/stream/transport.h"

namespace terrane {

/// A line as simple as it can be: each request reaches the server and its first byte comes back after
/// `latencySeconds`; bytes come at `bytesPerSecond`, one answer after the other in the order of the requests.
struct LineModel {
  double bytesPerSecond = 5e6;
  double latencySeconds = 0.05;
};

/// What goes wrong on it. Shares are of all answers, 0 to 1, drawn from `seed` in the order of requests.
struct LineFaults {
  double busyShare = 0.0;       ///< answers "500"
  double slowShare = 0.0;       ///< answers that come up to slowSeconds later
  double truncatedShare = 0.0;  ///< answers with fewer bytes
  double corruptShare = 0.0;    ///< answers with some bits wrong
  double missingShare = 0.0;    ///< answers "404", for good: the same range always
  double slowSeconds = 4.0;
  uint32_t seed = 1;
  std::vector<std::pair<double, double>> outages;  ///< begin and end: no server there
};

/// A dataset's directory behind a simulated line, in simulated time: what comes when depends on nothing but
/// the requests and the times that poll() is told. Reads files when requests start, so it is for tests and
/// benches.
class SimulatedLine final : public Transport {
 public:
  SimulatedLine(std::string directory, LineModel model, LineFaults faults = {});

  void start(uint64_t id, const FetchRequest& request) override;
  void cancel(uint64_t id) override;
  std::vector<FetchAnswer> poll(double nowSeconds) override;
  const std::string& where() const override { return directory_; }

  /// From now on faults are others.
  void setFaults(const LineFaults& faults) { faults_ = faults; }
  uint64_t bytesDelivered() const { return bytesDelivered_; }
  uint64_t requestsStarted() const { return requestsStarted_; }
  uint64_t answersSpoilt() const { return answersSpoilt_; }

 private:
  struct Underway {
    FetchAnswer answer;
    double readySeconds = 0.0;  ///< when its first byte can be here
    double bytesLeft = 0.0;
    double lateSeconds = 0.0;   ///< after its last byte
    bool takesLine = true;
  };
  FetchAnswer read(uint64_t id, const FetchRequest& request) const;
  void spoil(Underway& underway, const FetchRequest& request);
  void advance(double nowSeconds);

  std::string directory_;
  LineModel model_;
  LineFaults faults_;
  std::mt19937 random_;
  double now_ = 0.0;
  std::deque<Underway> line_;
  std::vector<Underway> late_;  ///< whole, but held back; readySeconds is when they come
  uint64_t bytesDelivered_ = 0;
  uint64_t requestsStarted_ = 0;
  uint64_t answersSpoilt_ = 0;
};

}  // namespace terrane
